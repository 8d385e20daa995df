#include "modules/tree_newton/chordal.hpp"

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <stdexcept>

#include "modules/core/geometry/lie.hpp"

namespace km {
namespace {

using Sparse = Eigen::SparseMatrix<double>;
using Entries = std::vector<Eigen::Triplet<double>>;

// Solves B X = C for X; B is definite exactly if every pose is connected to pose 0.
Eigen::MatrixXd solve(const Entries& entries, const Eigen::MatrixXd& C) {
  Sparse B(C.rows(), C.rows());
  B.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SimplicialLDLT<Sparse> ldlt(B);
  const bool singular = ldlt.info() != Eigen::Success ||
                        !(ldlt.vectorD().minCoeff() > 1e-12 * ldlt.vectorD().maxCoeff());
  if (singular)
    throw std::invalid_argument("chordal_initialisation: the edges do not connect all poses");
  return ldlt.solve(C);
}

void append(Entries& entries, Eigen::Index row, Eigen::Index col, const Eigen::Matrix3d& block) {
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c)
      entries.emplace_back(static_cast<int>(3 * row + r), static_cast<int>(3 * col + c),
                           block(r, c));
}

// Transposed rotations, stacked: edge residual R_j^T - R_ij^T R_i^T. Pose 0 is known.
std::vector<Eigen::Matrix3d> solve_rotations(Eigen::Index poses, std::span<const PoseEdge> edges) {
  Entries entries;
  Eigen::MatrixXd C = Eigen::MatrixXd::Zero(3 * (poses - 1), 3);
  const auto add = [&](Eigen::Index i, Eigen::Index j, const Eigen::Matrix3d& block) {
    if (i == 0) return;
    if (j == 0)
      C.middleRows<3>(3 * (i - 1)) -= block;
    else
      append(entries, i - 1, j - 1, block);
  };
  for (const PoseEdge& e : edges) {
    const Eigen::Index i = e.from.index, j = e.to.index;
    const Eigen::Matrix3d R = e.T_from_to.linear();
    const Eigen::Matrix3d I = Eigen::Matrix3d::Identity();
    const double kappa = e.precision.kappa;
    add(i, i, kappa * I);
    add(j, j, kappa * I);
    add(i, j, -kappa * R);
    add(j, i, -kappa * R.transpose());
  }
  const Eigen::MatrixXd stacked = solve(entries, C);
  std::vector<Eigen::Matrix3d> rotations(1, Eigen::Matrix3d::Identity());
  for (Eigen::Index i = 0; i + 1 < poses; ++i)
    rotations.push_back(nearest_rotation(stacked.middleRows<3>(3 * i).transpose()));
  return rotations;
}

Eigen::MatrixXd solve_translations(Eigen::Index poses, std::span<const PoseEdge> edges,
                                   const std::vector<Eigen::Matrix3d>& rotations) {
  Entries entries;
  Eigen::MatrixXd C = Eigen::MatrixXd::Zero(poses - 1, 3);
  for (const PoseEdge& e : edges) {
    const double tau = e.precision.tau;
    const Eigen::Vector3d step = tau * (rotations[e.from.index] * e.T_from_to.translation());
    const auto i = static_cast<int>(e.from.index) - 1;
    const auto j = static_cast<int>(e.to.index) - 1;
    if (i >= 0) entries.emplace_back(i, i, tau);
    if (j >= 0) entries.emplace_back(j, j, tau);
    if (i >= 0 && j >= 0) {
      entries.emplace_back(i, j, -tau);
      entries.emplace_back(j, i, -tau);
    }
    if (i >= 0) C.row(i) -= step.transpose();
    if (j >= 0) C.row(j) += step.transpose();
  }
  return solve(entries, C);
}

double cost_of(std::span<const PoseEdge> edges, const std::vector<SE3>& poses) {
  double sum = 0.0;
  for (const PoseEdge& e : edges) {
    const double r = residual_of(e, poses[e.from.index], poses[e.to.index]);
    sum += r * r;
  }
  return sum;
}

}  // namespace

std::vector<SE3> chordal_initialisation(Eigen::Index poses, std::span<const PoseEdge> edges) {
  std::vector<SE3> result(static_cast<std::size_t>(poses), SE3::Identity());
  if (poses < 2) return result;
  const std::vector<Eigen::Matrix3d> rotations = solve_rotations(poses, edges);
  const Eigen::MatrixXd translations = solve_translations(poses, edges, rotations);
  for (std::size_t i = 1; i < result.size(); ++i)
    result[i] = make_pose(rotations[i], translations.row(static_cast<Eigen::Index>(i) - 1));
  return result;
}

std::vector<SE3> better_of_chordal(std::vector<SE3> poses, std::span<const PoseEdge> own) {
  // Without a closure across an unknown step, its weight is too small for a factorisation.
  constexpr Precision kLeast{0.1, 1e-3};
  std::vector<PoseEdge> edges(own.begin(), own.end());
  for (PoseEdge& e : edges)
    e.precision = {std::max(e.precision.kappa, kLeast.kappa),
                   std::max(e.precision.tau, kLeast.tau)};
  std::vector<SE3> chordal = chordal_initialisation(static_cast<Eigen::Index>(poses.size()), edges);
  for (SE3& T : chordal) T = poses.front() * T;
  return cost_of(edges, chordal) < cost_of(edges, poses) ? chordal : poses;
}

}  // namespace km
