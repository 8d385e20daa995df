#include "modules/pgo_study/certificate.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <queue>

#include "modules/pgo_study/lanczos.hpp"
#include "modules/pose_graph/frontal_cholesky.hpp"

namespace km {
namespace {

using Eigen::Index;

constexpr double kCertifiedGap = 1e-4;
constexpr double kTightGap = 1e-8;
constexpr double kRounding = 1e-12;    // of the precisions that meet in a pose
constexpr double kLeastShift = 1e-14;  // likewise: below, a singular S has no Cholesky factor
constexpr double kShiftGrowth = 30.0;
constexpr int kMaxProducts = 60;
constexpr double kEigenTolerance = 1e-6;
constexpr double kUnitRoundoff = 0.5 * std::numeric_limits<double>::epsilon();

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
                                 Index pose, double held) {
  S.coeffRef(4 * pose + 3, 4 * pose + 3) += held;
  if (!problem.verticals().empty())
    for (const int filling : {0, 1, 3}) {
      const Index k = 4 * problem.poses() + filling;
      S.coeffRef(k, k) += held;
    }
  return S;
}

// S + shift * units, factorised for one shift after the other.
class ShiftedCholesky {
 public:
  explicit ShiftedCholesky(const Eigen::SparseMatrix<double>& S) : cholesky_(make_plan(S)) {
    const std::vector<NodePair>& pairs = cholesky_.plan().pairs();
    const auto nodes = static_cast<std::size_t>(cholesky_.plan().nodes());
    S_ = BlockMatrix::zero(4, nodes, pairs.size());
    int pair = 0;
    for (int j = 0; j < cholesky_.plan().nodes(); ++j) {  // the order of make_plan()
      for (Index c = 0; c < 4; ++c)
        for (Eigen::SparseMatrix<double>::InnerIterator s(S, 4 * j + c); s; ++s)
          if (s.row() / 4 == j) S_.at(j)(s.row() % 4, c) = s.value();
      const int first = pair;
      while (pair < static_cast<int>(pairs.size()) && pairs[static_cast<std::size_t>(pair)][1] == j)
        ++pair;
      for (Index c = 0; c < 4; ++c) {
        int here = first;
        for (Eigen::SparseMatrix<double>::InnerIterator s(S, 4 * j + c); s && s.row() / 4 < j;
             ++s) {
          while (pairs[static_cast<std::size_t>(here)][0] != s.row() / 4) ++here;
          S_.between(here)(s.row() % 4, c) = s.value();
        }
      }
    }
  }

  // False: S + shift * units is not positive definite, but for rounding.
  [[nodiscard]] bool factorise(const Eigen::VectorXd& units, double shift) {
    A_ = S_;
    for (Index i = 0; i < units.size(); ++i) A_.diagonal(i % 4, i) += shift * units(i);
    return cholesky_.factorise(A_);
  }

  [[nodiscard]] Eigen::VectorXd solve(const Eigen::VectorXd& b) const {
    Eigen::MatrixXd x = b;
    cholesky_.forward(x);
    cholesky_.backward(x);
    return x;
  }

  // The last factors are exact for a matrix A + E with |E_ij| <= c u (|L| |L|^T)_ij but for u^2, c
  // being the terms of the sum (Higham, "Accuracy and Stability of Numerical Algorithms", 10.1.1).
  // If no |Z_ij| is above reach_i reach_j, tr(E Z) is at most this; c is at most the geometric mean
  // of the numbers of entries of L's rows i and j.
  [[nodiscard]] double rounding(const Eigen::VectorXd& reach) const {
    constexpr double kMoreTerms = 3.0;  // reciprocal, product or square root, second order
    const EliminationPlan& plan = cholesky_.plan();
    Eigen::VectorXd terms = Eigen::VectorXd::Constant(plan.nodes(), kMoreTerms);
    for (const EliminationPlan::Front& front : plan.fronts())
      for (std::size_t k = 0; k < front.nodes.size(); ++k)
        terms(front.nodes[k]) +=
            4.0 * std::min(static_cast<double>(k + 1), static_cast<double>(front.pivots));
    Eigen::VectorXd weight = reach;
    for (Index k = 0; k < weight.size(); ++k) weight(k) *= std::sqrt(terms(k / 4));
    return kUnitRoundoff * cholesky_.magnitude(weight);
  }

 private:
  static std::shared_ptr<const EliminationPlan> make_plan(const Eigen::SparseMatrix<double>& S) {
    const Index nodes = S.rows() / 4;
    std::vector<NodePair> pairs;
    std::vector<Index> seen(static_cast<std::size_t>(nodes), -1);
    for (Index j = 0; j < nodes; ++j) {
      const std::size_t first = pairs.size();
      for (Index c = 0; c < 4; ++c)
        for (Eigen::SparseMatrix<double>::InnerIterator s(S, 4 * j + c); s && s.row() / 4 < j;
             ++s) {
          Index& mark = seen[static_cast<std::size_t>(s.row() / 4)];
          if (mark == j) continue;
          mark = j;
          pairs.push_back({static_cast<int>(s.row() / 4), static_cast<int>(j)});
        }
      std::sort(pairs.begin() + static_cast<std::ptrdiff_t>(first), pairs.end());
    }
    return std::make_shared<const EliminationPlan>(
        std::vector<bool>(static_cast<std::size_t>(nodes), false), std::move(pairs));
  }

  FrontalCholesky cholesky_;
  BlockMatrix S_;
  BlockMatrix A_;
};

// Shortest paths over the edges from pose `from`: their lengths [m], and the sums of 1 / tau.
struct Paths {
  Eigen::VectorXd length_m;
  Eigen::VectorXd variance;
};

Paths shortest_paths(const QuadraticProblem& problem, Index from) {
  struct Step {
    Index to;
    double length_m;
    double variance;
  };
  std::vector<std::vector<Step>> steps(static_cast<std::size_t>(problem.poses()));
  for (const BlockEdge& e : problem.edges()) {
    const double length_m = e.T_i_j.translation().norm();
    steps[static_cast<std::size_t>(e.i)].push_back({e.j, length_m, 1.0 / e.tau});
    steps[static_cast<std::size_t>(e.j)].push_back({e.i, length_m, 1.0 / e.tau});
  }
  constexpr double kFar = std::numeric_limits<double>::infinity();
  Paths paths{Eigen::VectorXd::Constant(problem.poses(), kFar),
              Eigen::VectorXd::Constant(problem.poses(), kFar)};
  paths.length_m(from) = paths.variance(from) = 0.0;
  using Entry = std::pair<double, Index>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
  for (queue.emplace(0.0, from); !queue.empty();) {
    const auto [length_m, i] = queue.top();
    queue.pop();
    if (length_m > paths.length_m(i)) continue;
    for (const Step& step : steps[static_cast<std::size_t>(i)]) {
      if (!(length_m + step.length_m < paths.length_m(step.to))) continue;
      paths.length_m(step.to) = length_m + step.length_m;
      paths.variance(step.to) = paths.variance(i) + step.variance;
      queue.emplace(paths.length_m(step.to), step.to);
    }
  }
  return paths;
}

// A pose from which the others are not far.
Index middle_pose(const QuadraticProblem& problem) {
  const auto farthest = [](const Eigen::VectorXd& lengths) {
    Index pose = 0;
    lengths.maxCoeff(&pose);
    return pose;
  };
  const Eigen::VectorXd from_one =
      shortest_paths(problem, farthest(shortest_paths(problem, 0).length_m)).length_m;
  const Eigen::VectorXd from_other = shortest_paths(problem, farthest(from_one)).length_m;
  Index middle = 0;
  from_one.cwiseMax(from_other).minCoeff(&middle);
  return middle;
}

// How large the columns of poses that cost at most `cost` can be if `held` stands at the origin: 1
// on rotations; a translation is at most the sum of those measured on the way there and of their
// residuals e, and sum |e| <= sqrt(sum 1 / tau) sqrt(sum tau |e|^2).
Eigen::VectorXd reach_of(const QuadraticProblem& problem, const Eigen::VectorXd& units, Index held,
                         double cost) {
  const Paths paths = shortest_paths(problem, held);
  Eigen::VectorXd reach = units;
  for (Index i = 0; i < problem.poses(); ++i)
    reach(4 * i + 3) = paths.length_m(i) + std::sqrt(cost * paths.variance(i));
  return reach;
}

// How many other edges each has between the same two poses.
std::vector<int> parallel_edges(const std::vector<BlockEdge>& edges) {
  const auto pair_of = [](const BlockEdge& e) { return std::minmax(e.i, e.j); };
  std::map<std::pair<Index, Index>, int> count;
  for (const BlockEdge& e : edges) ++count[pair_of(e)];
  std::vector<int> others;
  others.reserve(edges.size());
  for (const BlockEdge& e : edges) others.push_back(count[pair_of(e)] - 1);
  return others;
}

// tr(E Z) at most for what rounding, E, has made of S on the way from edges and multipliers to its
// entries. Those of an edge are -kappa R, kappa R R^T + tau t t^T, tau t and tau; on the diagonal
// as many are summed as the pose has edges. tau is not rounded but in sums.
double assembly_rounding(const QuadraticProblem& problem, const Eigen::VectorXd& multipliers,
                         const Eigen::VectorXd& reach) {
  constexpr double kTerms = 12.0;  // of an entry of T Omega T^T, and its subtractions
  const double rotation = std::pow(1.0 + std::sqrt(3.0), 2);  // column sums of |R|: up to sqrt(3)
  Eigen::VectorXd degree = Eigen::VectorXd::Zero(problem.poses());
  for (const BlockEdge& e : problem.edges())
    for (const Index i : {e.i, e.j}) degree(i) += 1.0;
  const std::vector<int> parallel = parallel_edges(problem.edges());
  double sum = 0.0;
  for (std::size_t k = 0; k < problem.edges().size(); ++k) {
    const BlockEdge& e = problem.edges()[k];
    const double d = std::max(degree(e.i), degree(e.j));
    const double t = std::sqrt(3.0) * e.T_i_j.translation().norm();  // sum of |t_c|, at most
    const double p_i = reach(4 * e.i + 3);
    const double p_j = reach(4 * e.j + 3);
    sum += (kTerms + d) * (3.0 * e.kappa * rotation + e.tau * t * (t + 2.0 * (p_i + p_j))) +
           e.tau * (degree(e.i) * p_i * p_i + degree(e.j) * p_j * p_j);
    sum += 2.0 * static_cast<double>(parallel[k]) * e.tau * p_i * p_j;
  }
  const auto n = static_cast<double>(multipliers.size());
  for (const VerticalPrior& v : problem.verticals()) sum += (kTerms + n) * 8.0 * v.weight;
  return kUnitRoundoff * (sum + (kTerms + n) * multipliers.cwiseAbs().sum());
}

// The best translations for the rotations of X: with others, which over long chains differ by much
// at next to no cost, the bound would be loose.
LiftedPoses with_best_translations(const QuadraticProblem& problem, LiftedPoses X, Index pose,
                                   double held) {
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
  entries.emplace_back(static_cast<int>(pose), static_cast<int>(pose), held);
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

// sym(Y_i^T (X Q)_Y,i) of every pose, side by side. Whatever X is, S and tr(Lambda) belong
// together.
Eigen::Matrix3Xd multipliers(const QuadraticProblem& problem, const LiftedPoses& X) {
  const LiftedPoses XQ = 0.5 * problem.euclidean_gradient(X);
  Eigen::Matrix3Xd Lambda(3, 3 * problem.poses());
  for (Index i = 0; i < problem.poses(); ++i) {
    const Eigen::Matrix3d product = X.middleCols<3>(4 * i).transpose() * XQ.middleCols<3>(4 * i);
    Lambda.middleCols<3>(3 * i) = 0.5 * (product + product.transpose());
  }
  return Lambda;
}

// tr(Lambda) with the vertical's multiplier and what the priors hold whatever X is.
double dual_value(const QuadraticProblem& problem, const LiftedPoses& X,
                  const Eigen::Matrix3Xd& Lambda) {
  double sum = 0.0;
  for (Index i = 0; i < problem.poses(); ++i) sum += Lambda.middleCols<3>(3 * i).trace();
  const Eigen::VectorXd z = lifting_matrix(X.rows()).col(2);
  for (const VerticalPrior& v : problem.verticals())
    sum += v.weight * (1.0 + v.up.squaredNorm() - z.dot(X.middleCols<3>(4 * v.pose) * v.up));
  return sum;
}

// What is left once one pose stands at the origin: the eigenvalue problem of certify().
class ProofOf {
 public:
  ProofOf(const QuadraticProblem& problem, const LiftedPoses& X)
      : held_(middle_pose(problem)), units_(unit_columns(problem)) {
    const double held = problem.largest_degrees().y();
    best_ = with_best_tilt(problem, with_best_translations(problem, X, held_, held));
    for (Index i = 0; i < problem.poses(); ++i)
      if (i != held_) best_.col(4 * i + 3) -= best_.col(4 * held_ + 3);
    best_.col(4 * held_ + 3).setZero();
    const Eigen::Matrix3Xd Lambda = multipliers(problem, best_);
    cholesky_.emplace(hold(certificate_matrix(problem, best_), problem, held_, held));
    dual_ = dual_value(problem, best_, Lambda);
    reach_ = reach_of(problem, units_, held_, problem.cost(X));
    assembly_rounding_ = assembly_rounding(problem, Lambda.reshaped(), reach_);
  }

  [[nodiscard]] bool definite(double shift) { return cholesky_->factorise(units_, shift); }

  // After definite(shift): what costs at most as much as X costs at least this.
  [[nodiscard]] double bound(double shift, double rounding) const {
    return std::max(0.0, dual_ - shift * units_.sum() - rounding);
  }
  [[nodiscard]] double rounding() const { return assembly_rounding_ + cholesky_->rounding(reach_); }

  // After definite(shift): the smallest eigenvalue, from above, and its direction. Rotations of (S
  // + shift)^-1 applied to rotations: the inverse of the shifted Schur complement.
  [[nodiscard]] LanczosResult smallest_eigenpair(double shift, unsigned seed) const {
    const auto inverse = [&](const Eigen::VectorXd& v) -> Eigen::VectorXd {
      return units_.cwiseProduct(cholesky_->solve(units_.cwiseProduct(v)));
    };
    LanczosResult result =
        largest_eigenpair(inverse, units_.size(), kMaxProducts, kEigenTolerance, seed);
    result.value = 1.0 / result.value - shift;
    result.vector = with_vertical_held(cholesky_->solve(result.vector), best_).normalized();
    return result;
  }

  [[nodiscard]] double trace() const { return units_.sum(); }

 private:
  Index held_;
  Eigen::VectorXd units_;
  LiftedPoses best_;
  std::optional<ShiftedCholesky> cholesky_;
  double dual_ = 0.0;
  Eigen::VectorXd reach_;
  double assembly_rounding_ = 0.0;
};

// Where no factorisation up to `refused` was definite the smallest eigenvalue is below -refused. A
// Ritz value above that has not seen its eigenvector: the next start does, or the one after.
LanczosResult eigenpair_below(const ProofOf& proof, double shift, double refused, unsigned seed) {
  constexpr unsigned kStarts = 4;
  constexpr unsigned kBetweenSeeds = 1000;
  LanczosResult least = proof.smallest_eigenpair(shift, seed);
  for (unsigned k = 1; refused > 0.0 && k < kStarts && least.value > -refused; ++k) {
    LanczosResult other = proof.smallest_eigenpair(shift, seed + k * kBetweenSeeds);
    if (other.value < least.value) least = std::move(other);
  }
  return least;
}

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
  Certificate certificate;
  const auto prove = [&](double shift) {
    const double rounding = proof.rounding();
    certificate.lambda_bound = -shift - rounding / proof.trace();
    certificate.relative_gap = std::max(0.0, (cost - proof.bound(shift, rounding)) / scale);
    certificate.certified = certificate.relative_gap <= kCertifiedGap;
    certificate.hidden_by_rounding =
        !certificate.certified && cost - proof.bound(shift, 0.0) <= kCertifiedGap * scale;
    return certificate.certified || certificate.hidden_by_rounding;
  };
  double refused = 0.0;
  double shift = tight;
  bool decided = false;
  for (const double tried : {tight, allowed}) {
    if (decided) break;
    shift = tried;
    if (proof.definite(shift))
      decided = prove(shift);
    else
      refused = shift;
  }
  if (certificate.certified) return certificate;
  if (!decided) {
    shift = std::max(refused > 0.0 ? kShiftGrowth * refused : allowed, kRounding * degree);
    while (!proof.definite(shift)) {
      refused = shift;
      shift *= kShiftGrowth;
    }
    static_cast<void>(prove(shift));
  }
  // Another start at every rank: a direction left in the last escape hides its multiples.
  const LanczosResult least =
      eigenpair_below(proof, shift, refused, static_cast<unsigned>(X.rows()));
  certificate.lambda_min = least.value;
  certificate.direction = least.vector;
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
