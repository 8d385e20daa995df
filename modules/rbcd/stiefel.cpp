#include "modules/rbcd/stiefel.hpp"

#include <Eigen/Eigenvalues>

#include "modules/core/geometry/lie.hpp"
#include "modules/rbcd/rank_dispatch.hpp"

namespace km {

double stiefel_error(const LiftedPoses& X) {
  double error = 0.0;
  for (Eigen::Index i = 0; i < pose_count(X); ++i) {
    const auto Y = X.middleCols<3>(4 * i);
    const Eigen::Matrix3d gram = Y.transpose() * Y;
    error = std::max(error, (gram - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff());
  }
  return error;
}

LiftedPoses restore_stiefel(LiftedPoses X) {
  // Newton-Schulz iteration for the polar factor: each step squares the error.
  constexpr int kIterations = 5;
  for (Eigen::Index i = 0; i < pose_count(X); ++i) {
    auto Y = X.middleCols<3>(4 * i);
    for (int k = 0; k < kIterations; ++k)
      Y = (Y * (1.5 * Eigen::Matrix3d::Identity() - 0.5 * (Y.transpose() * Y).eval())).eval();
  }
  return X;
}

LiftedPoses project_tangent(const LiftedPoses& X, const LiftedPoses& V) {
  LiftedPoses projected = V;
  dispatch_rank(X.rows(), [&]<int kRank>() {
    for (Eigen::Index i = 0; i < pose_count(X); ++i) {
      const auto Y = lifted_block<kRank, 3>(X, 4 * i);
      auto P = lifted_block<kRank, 3>(projected, 4 * i);
      const Eigen::Matrix3d S = Y.transpose() * P;
      P.noalias() -= Y * (0.5 * (S + S.transpose())).eval();
    }
  });
  return projected;
}

LiftedPoses retract(const LiftedPoses& X, const LiftedPoses& V) {
  LiftedPoses moved = X + V;
  for (Eigen::Index i = 0; i < pose_count(X); ++i) {
    const auto V_i = V.middleCols<3>(4 * i);
    const Eigen::Matrix3d gram = Eigen::Matrix3d::Identity() + V_i.transpose() * V_i;
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(gram);
    moved.middleCols<3>(4 * i) = (moved.middleCols<3>(4 * i) * eigen.operatorInverseSqrt()).eval();
  }
  return moved;
}

LiftedPoses perturb_rotations(const LiftedPoses& X, double sigma, std::mt19937& rng) {
  std::normal_distribution<double> normal(0.0, sigma);
  LiftedPoses V = LiftedPoses::Zero(X.rows(), X.cols());
  for (Eigen::Index i = 0; i < pose_count(X); ++i)
    for (double& v : V.middleCols<3>(4 * i).reshaped()) v = normal(rng);
  return retract(X, project_tangent(X, V));
}

Eigen::MatrixXd lifting_matrix(Eigen::Index rank) {
  return Eigen::MatrixXd::Identity(rank, 3);
}

Eigen::MatrixXd lift(const Eigen::MatrixXd& L, const SE3& T) {
  return L * T.matrix();
}

Eigen::MatrixXd lifted_identity(Eigen::Index rank) {
  return Eigen::MatrixXd::Identity(rank, 3) * Eigen::Matrix<double, 3, 4>::Identity();
}

LiftedPoses lift(std::span<const SE3> poses, Eigen::Index rank) {
  const Eigen::MatrixXd L = lifted_identity(rank);
  LiftedPoses X(rank, 4 * static_cast<Eigen::Index>(poses.size()));
  for (std::size_t i = 0; i < poses.size(); ++i)
    X.middleCols<4>(4 * static_cast<Eigen::Index>(i)) = lift(L, poses[i]);
  return X;
}

std::vector<SE3> round_to_poses(const LiftedPoses& X, const Eigen::MatrixXd& anchor) {
  const Eigen::Matrix<double, 3, Eigen::Dynamic> Yt = anchor.leftCols<3>().transpose();
  std::vector<SE3> poses;
  poses.reserve(static_cast<std::size_t>(pose_count(X)));
  for (Eigen::Index i = 0; i < pose_count(X); ++i)
    poses.push_back(make_pose(nearest_rotation(Yt * X.middleCols<3>(4 * i)),
                              Yt * (X.col(4 * i + 3) - anchor.col(3))));
  return poses;
}

}  // namespace km
