#include "apps/lab/pgo_study/certificate_agent.hpp"

#include <Eigen/Eigenvalues>
#include <cmath>
#include <random>
#include <utility>

namespace km {
namespace {

// Shifts of the preconditioner, relative to the largest sums of kappa and tau at a pose.
constexpr double kRotationShift = 1e-4;
constexpr double kTranslationShift = 1e-10;

LiftedPoses weighted(LiftedPoses v) {
  for (Eigen::Index i = 3; i < v.cols(); i += 4) v.col(i) *= CertificateAgent::kTranslationWeight;
  return v;
}

}  // namespace

CertificateAgent::CertificateAgent(const SessionGraph& part, LiftedPoses X, std::uint32_t seed)
    : self_(part.self),
      border_(border_of(part)),
      X_(std::move(X)),
      fixed_(LiftedPoses::Zero(X_.rows(), 4 * static_cast<Eigen::Index>(border_.fixed_of.size()))),
      problem_(1, pose_count(X_), block_edges(part.own), border_.edges),
      seed_(seed) {}

LiftedPoses CertificateAgent::public_columns(const LiftedPoses& M) const {
  LiftedPoses columns(M.rows(), 4 * static_cast<Eigen::Index>(border_.own.size()));
  for (std::size_t k = 0; k < border_.own.size(); ++k)
    columns.middleCols<4>(4 * static_cast<Eigen::Index>(k)) =
        M.middleCols<4>(4 * Eigen::Index{border_.own[k]});
  return columns;
}

void CertificateAgent::set_neighbour(RobotId robot, const std::vector<KeyframeIndex>& keyframes,
                                     const LiftedPoses& columns) {
  if (fixed_.rows() != columns.rows()) fixed_.setZero(columns.rows(), fixed_.cols());
  for (std::size_t k = 0; k < keyframes.size(); ++k) {
    const auto slot = border_.fixed_of.find({robot, keyframes[k]});
    if (slot != border_.fixed_of.end())
      fixed_.middleCols<4>(4 * slot->second) =
          columns.middleCols<4>(4 * static_cast<Eigen::Index>(k));
  }
}

void CertificateAgent::make_multipliers() {
  LiftedPoses XQ(X_.rows(), X_.cols());
  for (Eigen::Index row = 0; row < X_.rows(); ++row) {
    problem_.set_fixed(fixed_.row(row));
    XQ.row(row) = 0.5 * problem_.euclidean_gradient(X_.row(row));
  }
  for (Eigen::Index i = 0; i < pose_count(X_); ++i) {
    const Eigen::Matrix3d product = X_.middleCols<3>(4 * i).transpose() * XQ.middleCols<3>(4 * i);
    Lambda_.push_back(0.5 * (product + product.transpose()));
  }
}

void CertificateAgent::factorise() {
  Eigen::SparseMatrix<double> S = problem_.data_matrix();
  std::vector<Eigen::Triplet<double>> entries;
  for (Eigen::Index i = 0; i < problem_.poses(); ++i)
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c)
        entries.emplace_back(static_cast<int>(4 * i) + r, static_cast<int>(4 * i) + c,
                             Lambda_[static_cast<std::size_t>(i)](r, c));
  Eigen::SparseMatrix<double> all(S.rows(), S.cols());
  all.setFromTriplets(entries.begin(), entries.end());
  S -= all;
  const Eigen::Vector2d degree = problem_.largest_degrees();
  for (double shift = kRotationShift * degree.x();; shift *= 10.0) {
    Eigen::SparseMatrix<double> A = S;
    A.diagonal() += Eigen::Vector4d(shift, shift, shift, kTranslationShift * degree.y())
                        .replicate(problem_.poses(), 1);
    if (auto factor = BlockCholesky::try_factorise(A)) {
      preconditioner_ = std::make_unique<const BlockCholesky>(std::move(*factor));
      return;
    }
  }
}

Eigen::MatrixXd CertificateAgent::kernel_sums() {
  make_multipliers();
  factorise();
  const Eigen::Index rows = X_.rows() + 1;
  K_ = LiftedPoses::Zero(rows, X_.cols());
  K_.topRows(X_.rows()) = X_;
  for (Eigen::Index i = 3; i < X_.cols(); i += 4) K_(rows - 1, i) = 1.0;
  Eigen::MatrixXd sums = Eigen::MatrixXd::Zero(rows, rows + 1);
  sums.leftCols(rows) = K_ * weighted(K_).transpose();
  for (Eigen::Index row = 0; row < X_.rows(); ++row) {
    problem_.set_fixed(fixed_.row(row));
    sums(0, rows) += problem_.cost(X_.row(row));
    for (std::size_t k = 0; k < border_.edges.size(); ++k)
      if (border_.robot_of_edge[k] > self_)
        sums(0, rows) -= problem_.public_edge_cost(k, X_.row(row));
  }
  for (const BlockEdge& e : problem_.edges()) sums(1, rows) += 2.0 * e.kappa;
  for (const PublicEdge& e : problem_.public_edges()) sums(1, rows) += e.kappa;
  sums(2, rows) = static_cast<double>(problem_.poses());
  return sums;
}

void CertificateAgent::set_kernel(const Eigen::MatrixXd& sums) {
  constexpr double kIndependent = 1e-8;
  const Eigen::Index rows = sums.rows();
  cost_ = sums(0, rows);
  poses_ = sums(2, rows);
  degree_ = sums(1, rows) / poses_;
  const Eigen::VectorXd scale = sums.leftCols(rows).diagonal().unaryExpr(
      [](double d) { return d > 0.0 ? 1.0 / std::sqrt(d) : 0.0; });
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(
      scale.asDiagonal() * sums.leftCols(rows) * scale.asDiagonal());
  Eigen::MatrixXd basis(0, K_.cols());
  for (Eigen::Index k = 0; k < rows; ++k) {
    if (eigen.eigenvalues()(k) < kIndependent) continue;
    basis.conservativeResize(basis.rows() + 1, Eigen::NoChange);
    basis.bottomRows<1>() = (scale.asDiagonal() * eigen.eigenvectors().col(k)).transpose() * K_ /
                            std::sqrt(eigen.eigenvalues()(k));
  }
  K_ = basis;
  std::mt19937 rng(seed_);
  std::normal_distribution<double> normal;
  LiftedPoses start(1, X_.cols());
  for (double& v : start.reshaped()) v = normal(rng);
  w_ = preconditioner_->solve_rows(start);
  x_ = p_ = Sx_ = Sp_ = LiftedPoses::Zero(1, X_.cols());
  fixed_.setZero(1, fixed_.cols());
}

LiftedPoses CertificateAgent::times_S(const LiftedPoses& v) {
  problem_.set_fixed(fixed_);
  LiftedPoses product = 0.5 * problem_.euclidean_gradient(v);
  for (Eigen::Index i = 0; i < problem_.poses(); ++i)
    product.middleCols<3>(4 * i) -= v.middleCols<3>(4 * i) * Lambda_[static_cast<std::size_t>(i)];
  return product;
}

Eigen::MatrixXd CertificateAgent::iteration_sums() {
  Sw_ = times_S(w_);
  LiftedPoses basis(3, x_.cols());
  basis << x_, p_, w_;
  LiftedPoses S_basis(3, x_.cols());
  S_basis << Sx_, Sp_, Sw_;
  Eigen::MatrixXd sums = Eigen::MatrixXd::Zero(3, 7 + K_.rows());
  sums.leftCols<3>() = basis * weighted(basis).transpose();
  sums.middleCols<3>(3) = basis * S_basis.transpose();
  sums(0, 6) = (Sx_ - lambda_ * weighted(x_)).squaredNorm();
  sums.row(0).tail(K_.rows()) = (K_ * weighted(w_).transpose()).transpose();
  return sums;
}

CertificateState CertificateAgent::iterate(const Eigen::MatrixXd& sums) {
  constexpr double kIndependent = 1e-12;
  const Eigen::RowVectorXd c = sums.row(0).tail(K_.rows());
  w_ -= c * K_;
  Eigen::Matrix3d B = sums.leftCols<3>();
  B(2, 2) -= c.squaredNorm();
  Eigen::Matrix3d A = 0.5 * (sums.middleCols<3>(3) + sums.middleCols<3>(3).transpose());
  // Vectors that are still zero or linearly dependent are left out.
  Eigen::Vector3d scale;
  for (int i = 0; i < 3; ++i) scale(i) = B(i, i) > 0.0 ? 1.0 / std::sqrt(B(i, i)) : 0.0;
  B = (scale.asDiagonal() * B * scale.asDiagonal()).eval();
  A = (scale.asDiagonal() * A * scale.asDiagonal()).eval();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> gram(B);
  std::vector<Eigen::Vector3d> directions;
  for (int i = 0; i < 3; ++i)
    if (gram.eigenvalues()(i) > kIndependent)
      directions.emplace_back(gram.eigenvectors().col(i) / std::sqrt(gram.eigenvalues()(i)));
  Eigen::MatrixXd D(3, static_cast<Eigen::Index>(directions.size()));
  for (std::size_t i = 0; i < directions.size(); ++i)
    D.col(static_cast<Eigen::Index>(i)) = directions[i];
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> ritz(D.transpose() * A * D);
  lambda_ = ritz.eigenvalues()(0);
  combine(scale.cwiseProduct(D * ritz.eigenvectors().col(0)));
  w_ = preconditioner_->solve_rows(Sx_ - lambda_ * weighted(x_));
  return {
      .lambda = lambda_, .residual = std::sqrt(sums(0, 6)) / degree_, .iterations = ++iterations_};
}

void CertificateAgent::combine(const Eigen::Vector3d& y) {
  p_ = y(1) * p_ + y(2) * w_;
  Sp_ = y(1) * Sp_ + y(2) * Sw_;
  x_ = y(0) * x_ + p_;
  Sx_ = y(0) * Sx_ + Sp_;
}

}  // namespace km
