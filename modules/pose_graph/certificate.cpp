#include "modules/pose_graph/certificate.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "modules/pose_graph/lanczos.hpp"

namespace km {
namespace {

constexpr double kCertifiedGap = 1e-4;
constexpr double kRounding = 1e-12;  // of the precisions that meet in a pose
constexpr int kMaxProducts = 60;
constexpr double kEigenTolerance = 1e-6;

// 1 on the columns that are of unit length in every solution, the rotations' and the vertical's; 0
// on translations and on what is only there to fill the vertical's block.
Eigen::VectorXd unit_columns(const QuadraticProblem& problem) {
  const Eigen::Index poses = problem.poses();
  Eigen::VectorXd units = Eigen::Vector4d(1.0, 1.0, 1.0, 0.0).replicate(poses, 1);
  if (problem.verticals().empty()) return units;
  units.conservativeResize(4 * poses + 4);
  units.tail<4>() = Eigen::Vector4d::Unit(2);
  return units;
}

// `S` with what no cost depends on held: one translation, and the filling of the vertical's block.
Eigen::SparseMatrix<double> hold(Eigen::SparseMatrix<double> S, const QuadraticProblem& problem,
                                 double held) {
  S.coeffRef(3, 3) += held;
  if (!problem.verticals().empty())
    for (const int filling : {0, 1, 3}) {
      const Eigen::Index k = 4 * problem.poses() + filling;
      S.coeffRef(k, k) += held;
    }
  return S;
}

struct Factor {
  double shift;
  BlockCholesky cholesky;
};

// The least shift on `units` of a geometric series, from `shift` on, that makes S definite.
Factor factorise(const Eigen::SparseMatrix<double>& S, const Eigen::VectorXd& units, double shift) {
  constexpr double kGrowth = 30.0;
  for (;; shift *= kGrowth) {
    Eigen::SparseMatrix<double> A = S;
    A.diagonal() += shift * units;
    if (auto cholesky = BlockCholesky::try_factorise(A)) return {shift, std::move(*cholesky)};
  }
}

// The best translations for the rotations of X: with others, which over long chains differ by much
// at next to no cost, the bound would be loose.
LiftedPoses with_best_translations(const QuadraticProblem& problem, LiftedPoses X, double held) {
  const LiftedPoses XQ = 0.5 * problem.euclidean_gradient(X);
  const Eigen::SparseMatrix<double>& Q = problem.data_matrix();
  std::vector<Eigen::Triplet<double>> entries;
  Eigen::MatrixXd residual(X.rows(), problem.poses());
  for (Eigen::Index i = 0; i < problem.poses(); ++i) {
    residual.col(i) = XQ.col(4 * i + 3);
    for (Eigen::SparseMatrix<double>::InnerIterator q(Q, 4 * i + 3); q; ++q)
      if (q.row() % 4 == 3)
        entries.emplace_back(static_cast<int>(q.row() / 4), static_cast<int>(i), q.value());
  }
  entries.emplace_back(0, 0, held);
  Eigen::SparseMatrix<double> L(problem.poses(), problem.poses());
  L.setFromTriplets(entries.begin(), entries.end());
  const Eigen::MatrixXd correction = BlockCholesky(L).solve_rows(residual);
  for (Eigen::Index i = 0; i < problem.poses(); ++i) X.col(4 * i + 3) -= correction.col(i);
  return X;
}

// Turned as a whole, the least, to where the priors do not pull it any further: a common tilt costs
// its square, but loosens the bound in proportion, microradians by more than the cost.
LiftedPoses with_best_tilt(const QuadraticProblem& problem, const LiftedPoses& X) {
  Eigen::VectorXd up = Eigen::VectorXd::Zero(X.rows());
  for (const VerticalPrior& v : problem.verticals())
    up += v.weight * (X.middleCols<3>(4 * v.pose) * v.up);
  const Eigen::VectorXd z = lifting_matrix(X.rows()).col(2);
  constexpr double kOverhead = -0.5;  // cosine; from beyond there is no least turn to speak of
  const double norm = up.norm();
  if (!(up.dot(z) > kOverhead * norm)) return X;
  up /= norm;
  const Eigen::VectorXd middle = up + z;
  return X - middle * (middle.transpose() * X) / (1.0 + up.dot(z)) + 2.0 * z * (up.transpose() * X);
}

// The vertical's rows and columns of S. On the rotations the priors are linear, |Y up| being 1:
// what they add to Q and to Lambda there is the same.
void append_vertical(const QuadraticProblem& problem, const LiftedPoses& X,
                     std::vector<Eigen::Triplet<double>>& entries) {
  const Eigen::VectorXd z = lifting_matrix(X.rows()).col(2);
  const int place = static_cast<int>(4 * problem.poses()) + 2;
  for (const VerticalPrior& v : problem.verticals()) {
    for (int c = 0; c < 3; ++c) {
      const int row = static_cast<int>(4 * v.pose) + c;
      entries.emplace_back(row, place, -v.weight * v.up(c));
      entries.emplace_back(place, row, -v.weight * v.up(c));
    }
    entries.emplace_back(place, place, v.weight * z.dot(X.middleCols<3>(4 * v.pose) * v.up));
  }
}

// A multiple of [X z]'s row along z, to which S is blind, puts the vertical back in its place.
Eigen::VectorXd with_vertical_held(const Eigen::VectorXd& direction, const LiftedPoses& X) {
  const double moved = direction.size() > X.cols() ? direction(X.cols() + 2) : 0.0;
  return direction.head(X.cols()) - moved * X.row(2).transpose();
}

}  // namespace

Eigen::SparseMatrix<double> certificate_matrix(const QuadraticProblem& problem,
                                               const LiftedPoses& X) {
  const LiftedPoses XQ = 0.5 * problem.euclidean_gradient(X);
  const Eigen::SparseMatrix<double>& Q = problem.data_matrix();
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(static_cast<std::size_t>(Q.nonZeros() + 9 * problem.poses()) +
                  7 * problem.verticals().size());
  for (Eigen::Index j = 0; j < Q.cols(); ++j)
    for (Eigen::SparseMatrix<double>::InnerIterator q(Q, j); q; ++q)
      entries.emplace_back(static_cast<int>(q.row()), static_cast<int>(j), q.value());
  for (Eigen::Index i = 0; i < problem.poses(); ++i) {
    const Eigen::Matrix3d product = X.middleCols<3>(4 * i).transpose() * XQ.middleCols<3>(4 * i);
    const Eigen::Matrix3d Lambda = 0.5 * (product + product.transpose());
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c)
        entries.emplace_back(static_cast<int>(4 * i) + r, static_cast<int>(4 * i) + c,
                             -Lambda(r, c));
  }
  append_vertical(problem, X, entries);
  const Eigen::Index size = Q.rows() + (problem.verticals().empty() ? 0 : 4);
  Eigen::SparseMatrix<double> S(size, size);
  S.setFromTriplets(entries.begin(), entries.end());
  return S;
}

Certificate certify(const QuadraticProblem& problem, const LiftedPoses& X) {
  const Eigen::Vector2d degree = problem.largest_degrees();
  const LiftedPoses best = with_best_tilt(problem, with_best_translations(problem, X, degree.y()));
  const Eigen::VectorXd units = unit_columns(problem);
  const Eigen::SparseMatrix<double> S =
      hold(certificate_matrix(problem, best), problem, degree.y());
  const double cost = problem.cost(X);
  const double trace = units.sum();
  const double threshold = std::max(kCertifiedGap * cost / trace, kRounding * degree.x());
  const Factor factor = factorise(S, units, threshold);

  // Rotations of (S + shift)^-1 applied to rotations: the inverse of the shifted Schur complement.
  const auto inverse = [&](const Eigen::VectorXd& v) -> Eigen::VectorXd {
    const Eigen::VectorXd on_units = units.cwiseProduct(v);
    return units.cwiseProduct(factor.cholesky.solve_rows(on_units.transpose()).transpose());
  };
  // Another start at every rank: a direction left in the last escape hides its multiples.
  const LanczosResult largest = largest_eigenpair(inverse, S.rows(), kMaxProducts, kEigenTolerance,
                                                  static_cast<unsigned>(X.rows()));
  Certificate certificate;
  certificate.lambda_min = 1.0 / largest.value - factor.shift;
  const double bound = std::max(0.0, problem.cost(best) + certificate.lambda_min * trace);
  const double scale = std::max(cost, kRounding * degree.x() * trace);
  certificate.relative_gap = std::max(0.0, (cost - bound) / scale);
  certificate.certified = certificate.relative_gap <= kCertifiedGap;
  certificate.direction =
      with_vertical_held(factor.cholesky.solve_rows(largest.vector.transpose()).transpose(), best);
  certificate.direction.normalize();
  return certificate;
}

LiftedPoses escape(const QuadraticProblem& problem, const LiftedPoses& X,
                   const Eigen::VectorXd& direction) {
  LiftedPoses lifted = LiftedPoses::Zero(X.rows() + 1, X.cols());
  lifted.topRows(X.rows()) = X;
  LiftedPoses step = LiftedPoses::Zero(lifted.rows(), lifted.cols());
  step.bottomRows(1) = direction.transpose();
  const double cost = problem.cost(lifted);
  // One pose turns by half a radian at first.
  double largest = 0.0;
  for (Eigen::Index i = 0; i < problem.poses(); ++i)
    largest = std::max(largest, direction.segment<3>(4 * i).norm());
  constexpr int kMaxHalvings = 40;
  double length = 0.5 / std::max(largest, 1e-300);
  LiftedPoses best = lifted;
  double best_cost = cost;
  for (int k = 0; k < kMaxHalvings; ++k, length *= 0.5) {
    LiftedPoses candidate = retract(lifted, length * step);
    const double candidate_cost = problem.cost(candidate);
    if (candidate_cost >= best_cost && best_cost < cost) break;
    if (candidate_cost >= best_cost) continue;
    best = std::move(candidate);
    best_cost = candidate_cost;
  }
  return best;
}

}  // namespace km
