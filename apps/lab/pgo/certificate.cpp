#include "apps/lab/pgo/certificate.hpp"

#include <Eigen/SparseCholesky>
#include <algorithm>

namespace km {
namespace {

using Eigen::Index;

constexpr double kCertifiedGap = 1e-4;
constexpr double kTightGap = 1e-8;
constexpr double kRounding = 1e-12;  // relative to the largest sum of kappa at a pose
// Relative to the largest sum of kappa at a pose. With a smaller shift the Cholesky factorisation
// of a singular S fails.
constexpr double kLeastShift = 1e-14;
constexpr double kShiftGrowth = 30.0;

// 1 for the columns that have unit length in every solution: those of rotations, and the vertical.
// 0 for translations and for the padding of the block of the vertical.
Eigen::VectorXd unit_columns(const QuadraticProblem& problem) {
  const Eigen::Index poses = problem.poses();
  Eigen::VectorXd units = Eigen::Vector4d(1.0, 1.0, 1.0, 0.0).replicate(poses, 1);
  if (problem.verticals().empty()) return units;
  units.conservativeResize(4 * poses + 4);
  units.tail<4>() = Eigen::Vector4d::Unit(2);
  return units;
}

// `S` with `held` added to diagonal entries on which no cost depends: those of one translation and
// of the padding of the block of the vertical.
Eigen::SparseMatrix<double> hold(Eigen::SparseMatrix<double> S, const QuadraticProblem& problem,
                                 double held) {
  S.coeffRef(3, 3) += held;
  if (!problem.verticals().empty())
    for (const int filling : {0, 1, 3}) {
      const Index k = 4 * problem.poses() + filling;
      S.coeffRef(k, k) += held;
    }
  return S;
}

// Factorises S + shift * units for several shifts with one symbolic analysis.
class ShiftedCholesky {
 public:
  explicit ShiftedCholesky(Eigen::SparseMatrix<double> S) : S_(std::move(S)) {
    llt_.analyzePattern(S_);
  }

  // False: up to rounding, S + shift * units is not positive definite.
  [[nodiscard]] bool factorise(const Eigen::VectorXd& units, double shift) {
    Eigen::SparseMatrix<double> A = S_;
    A.diagonal() += shift * units;
    llt_.factorize(A);
    return llt_.info() == Eigen::Success;
  }

 private:
  Eigen::SparseMatrix<double> S_;
  Eigen::SimplicialLLT<Eigen::SparseMatrix<double>> llt_;
};

// X with the best translations for its rotations. Along long chains, translations can differ by
// much from the best ones at nearly the same cost, and the bound would be loose.
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

// X after the smallest common rotation that minimises the cost of the priors. The cost of a common
// tilt is quadratic in its angle, but it loosens the bound linearly. Microradians of tilt can
// loosen the bound by more than the cost.
LiftedPoses with_best_tilt(const QuadraticProblem& problem, const LiftedPoses& X) {
  Eigen::VectorXd up = Eigen::VectorXd::Zero(X.rows());
  for (const VerticalPrior& v : problem.verticals())
    up += v.weight * (X.middleCols<3>(4 * v.pose) * v.up);
  const Eigen::VectorXd z = lifting_matrix(X.rows()).col(2);
  constexpr double kOverhead = -0.5;  // cosine; at larger angles the smallest rotation is
                                      // ill-conditioned
  const double norm = up.norm();
  if (!(up.dot(z) > kOverhead * norm)) return X;
  up /= norm;
  const Eigen::VectorXd middle = up + z;
  return X - middle * (middle.transpose() * X) / (1.0 + up.dot(z)) + 2.0 * z * (up.transpose() * X);
}

// Appends the rows and columns of the vertical to S. On the rotations the priors are linear,
// because |Y up| is 1. They contribute equally to Q and to Lambda there.
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

// sym(Y_i^T (X Q)_Y,i) of every pose, side by side. The bound of certify() holds for every X,
// because S and tr(Lambda) use the same multipliers.
Eigen::Matrix3Xd multipliers(const QuadraticProblem& problem, const LiftedPoses& X) {
  const LiftedPoses XQ = 0.5 * problem.euclidean_gradient(X);
  Eigen::Matrix3Xd Lambda(3, 3 * problem.poses());
  for (Index i = 0; i < problem.poses(); ++i) {
    const Eigen::Matrix3d product = X.middleCols<3>(4 * i).transpose() * XQ.middleCols<3>(4 * i);
    Lambda.middleCols<3>(3 * i) = 0.5 * (product + product.transpose());
  }
  return Lambda;
}

// tr(Lambda) plus the multiplier of the vertical and the constant terms of the priors.
double dual_value(const QuadraticProblem& problem, const LiftedPoses& X,
                  const Eigen::Matrix3Xd& Lambda) {
  double sum = 0.0;
  for (Index i = 0; i < problem.poses(); ++i) sum += Lambda.middleCols<3>(3 * i).trace();
  const Eigen::VectorXd z = lifting_matrix(X.rows()).col(2);
  for (const VerticalPrior& v : problem.verticals())
    sum += v.weight * (1.0 + v.up.squaredNorm() - z.dot(X.middleCols<3>(4 * v.pose) * v.up));
  return sum;
}

// Eigenvalue problem of certify(), with one pose held at the origin.
class ProofOf {
 public:
  ProofOf(const QuadraticProblem& problem, const LiftedPoses& X) : units_(unit_columns(problem)) {
    const double held = problem.largest_degrees().y();
    const LiftedPoses best = with_best_tilt(problem, with_best_translations(problem, X, held));
    cholesky_.emplace(hold(certificate_matrix(problem, best), problem, held));
    dual_ = dual_value(problem, best, multipliers(problem, best));
  }

  [[nodiscard]] bool definite(double shift) { return cholesky_->factorise(units_, shift); }

  // Lower bound of the cost of all points that cost at most as much as X. Precondition:
  // definite(shift) was called last and returned true.
  [[nodiscard]] double bound(double shift) const {
    return std::max(0.0, dual_ - shift * units_.sum());
  }

  [[nodiscard]] double trace() const { return units_.sum(); }

 private:
  Eigen::VectorXd units_;
  std::optional<ShiftedCholesky> cholesky_;
  double dual_ = 0.0;
};

}  // namespace

Eigen::SparseMatrix<double> certificate_matrix(const QuadraticProblem& problem,
                                               const LiftedPoses& X) {
  const Eigen::Matrix3Xd Lambda = multipliers(problem, X);
  const Eigen::SparseMatrix<double>& Q = problem.data_matrix();
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(static_cast<std::size_t>(Q.nonZeros() + 9 * problem.poses()) +
                  7 * problem.verticals().size());
  for (Eigen::Index j = 0; j < Q.cols(); ++j)
    for (Eigen::SparseMatrix<double>::InnerIterator q(Q, j); q; ++q)
      entries.emplace_back(static_cast<int>(q.row()), static_cast<int>(j), q.value());
  for (Eigen::Index i = 0; i < problem.poses(); ++i) {
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c)
        entries.emplace_back(static_cast<int>(4 * i) + r, static_cast<int>(4 * i) + c,
                             -Lambda(r, 3 * i + c));
  }
  append_vertical(problem, X, entries);
  const Eigen::Index size = Q.rows() + (problem.verticals().empty() ? 0 : 4);
  Eigen::SparseMatrix<double> S(size, size);
  S.setFromTriplets(entries.begin(), entries.end());
  return S;
}

Certificate certify(const QuadraticProblem& problem, const LiftedPoses& X) {
  ProofOf proof(problem, X);
  const double degree = problem.largest_degrees().x();
  const double cost = problem.cost(X);
  const double scale = std::max(cost, kRounding * degree * proof.trace());
  const double allowed = std::max(0.5 * kCertifiedGap * cost / proof.trace(), kLeastShift * degree);
  const double tight = std::max(kTightGap * cost / proof.trace(), kLeastShift * degree);
  double shift = tight;
  if (!proof.definite(shift) && !proof.definite(shift = allowed)) {
    shift = std::max(kShiftGrowth * allowed, kRounding * degree);
    while (!proof.definite(shift)) shift *= kShiftGrowth;
  }
  const double gap = std::max(0.0, (cost - proof.bound(shift)) / scale);
  return {.certified = gap <= kCertifiedGap, .relative_gap = gap, .lambda_bound = -shift};
}

}  // namespace km
