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

Eigen::SparseMatrix<double> rotations_shifted(const Eigen::SparseMatrix<double>& S, double shift,
                                              double held) {
  Eigen::SparseMatrix<double> A = S;
  A.diagonal() += Eigen::Vector4d(shift, shift, shift, 0.0).replicate(S.rows() / 4, 1);
  A.coeffRef(3, 3) += held;
  return A;
}

struct Factor {
  double shift;
  BlockCholesky cholesky;
};

// The least shift of a geometric series, from `shift` on, that makes S definite.
Factor factorise(const Eigen::SparseMatrix<double>& S, double shift, double held) {
  constexpr double kGrowth = 30.0;
  for (;; shift *= kGrowth)
    if (auto cholesky = BlockCholesky::try_factorise(rotations_shifted(S, shift, held)))
      return {shift, std::move(*cholesky)};
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

Eigen::VectorXd without_translations(Eigen::VectorXd v) {
  for (Eigen::Index i = 3; i < v.size(); i += 4) v(i) = 0.0;
  return v;
}

}  // namespace

Eigen::SparseMatrix<double> certificate_matrix(const QuadraticProblem& problem,
                                               const LiftedPoses& X) {
  const LiftedPoses XQ = 0.5 * problem.euclidean_gradient(X);
  Eigen::SparseMatrix<double> S = problem.data_matrix();
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(static_cast<std::size_t>(9 * problem.poses()));
  for (Eigen::Index i = 0; i < problem.poses(); ++i) {
    const Eigen::Matrix3d product = X.middleCols<3>(4 * i).transpose() * XQ.middleCols<3>(4 * i);
    const Eigen::Matrix3d Lambda = 0.5 * (product + product.transpose());
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c)
        entries.emplace_back(static_cast<int>(4 * i) + r, static_cast<int>(4 * i) + c,
                             Lambda(r, c));
  }
  Eigen::SparseMatrix<double> all(S.rows(), S.cols());
  all.setFromTriplets(entries.begin(), entries.end());
  S -= all;
  return S;
}

Certificate certify(const QuadraticProblem& problem, const LiftedPoses& X) {
  const Eigen::Vector2d degree = problem.largest_degrees();
  const LiftedPoses best = with_best_translations(problem, X, degree.y());
  const Eigen::SparseMatrix<double> S = certificate_matrix(problem, best);
  const double cost = problem.cost(X);
  const double trace = 3.0 * static_cast<double>(problem.poses());
  const double threshold = std::max(kCertifiedGap * cost / trace, kRounding * degree.x());
  const Factor factor = factorise(S, threshold, degree.y());

  // Rotations of (S + shift)^-1 applied to rotations: the inverse of the shifted Schur complement.
  const auto inverse = [&](const Eigen::VectorXd& v) -> Eigen::VectorXd {
    return without_translations(
        factor.cholesky.solve_rows(without_translations(v).transpose()).transpose());
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
  certificate.direction = factor.cholesky.solve_rows(largest.vector.transpose()).transpose();
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
