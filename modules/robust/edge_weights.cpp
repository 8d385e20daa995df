#include "modules/robust/edge_weights.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "modules/core/geometry/lie.hpp"
#include "modules/robust/cycle_mixture.hpp"
#include "modules/robust/odometry_cycles.hpp"
#include "modules/robust/robust_schedule.hpp"

namespace km {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Weighing = TreeVerdict::Weighing;

// Weight of a rejected closure in the equations. Small enough not to bias the solution, positive so
// that the system stays regular.
constexpr double kFloor = 1e-10;
// Noise may be this many times larger than the solution shows before errors count as evidence
// against closures.
constexpr double kNoisier = 1.5;

// The error of a closure against all other edges, and the log odds that it is true.
struct ErrorAgainstOthers {
  double claimed = 0.0;  // [sigma of the closure as claimed]
  double log_odds = 0.0;
};

// The error of a closure with this `residual` and `weight` in a solution. `of_ends`: covariance of
// the relative pose of its ends there. nullopt if no other edge connects the ends, up to rounding.
std::optional<ErrorAgainstOthers> error_of(const PoseEdge& closure, double weight,
                                           const Vector6& residual, const MatrixXd& of_ends,
                                           double noise, double volume) {
  const Index B = of_ends.rows(), first = first_row_of(B);
  const int dimension = B == 3 ? 2 : 3;
  const MatrixXd Sigma = covariance_of(closure.precision).block(first, first, B, B);
  const MatrixXd weighed = Sigma / weight;
  const Eigen::LLT<MatrixXd> rest(weighed - of_ends);
  if (rest.info() != Eigen::Success) return std::nullopt;
  Vector6 error = Vector6::Zero();
  error.segment(first, B) = weighed * rest.solve(residual.segment(first, B));
  Matrix6 Sigma_error = Matrix6::Zero();
  Sigma_error.block(first, first, B, B) =
      std::pow(kNoisier * noise, 2) * (Sigma - weighed + weighed * rest.solve(weighed));
  const double squared = mahalanobis_length(error, Sigma_error, dimension).squared;
  const double log_if_true = log_density_if_true(error, Sigma_error, dimension);
  // A true closure ends in the volume, too: its density is not below that of a false one where it
  // is largest.
  const double largest =
      std::max(0.0, log_if_true + 0.5 * squared - log_density_if_false(error, volume, dimension));
  return ErrorAgainstOthers{
      std::sqrt(error.segment(first, B).dot(Sigma.ldlt().solve(error.segment(first, B)))),
      largest - 0.5 * squared};
}

}  // namespace

void EdgeWeights::unsettle() {
  for (EdgeWeight& edge : edges_) {
    edge.is_settled = edge.is_doubted = false;
    edge.weight = edge.candidate = 1.0;
  }
}

void EdgeWeights::weigh(const TreeVerdict& verdict, const FrontEdges& front,
                        std::span<const SE3> present, TreeSums& sums) {
  sums.doubted = std::exchange(doubted_, 0);
  sums.dropped = left_out_;
  for (std::size_t k = 0; k < edges_.size(); ++k) {
    EdgeWeight& edge = edges_[k];
    edge.candidate = edge.weight;
    sums.dropped += edge.weight > 0.5 ? 0 : 1;
    if (edge.is_doubted) continue;
    if (edge.is_open) {
      const EdgeSlot& slot = front.slots()[k];
      weigh_open(edge, verdict,
                 residual_of(front.graph().edges[k], present[at(slot.i)], present[at(slot.j)]),
                 sums);
    } else {
      sums.kept += !edge.is_odometry && edge.weight > 0.5 ? 1 : 0;
    }
  }
  limit_pairs(verdict, front, present, sums);
}

// Decided weights do not change; a weight that would be decided differently at the present poses
// counts as changed.
void EdgeWeights::weigh_open(EdgeWeight& edge, const TreeVerdict& verdict, double residual,
                             TreeSums& sums) {
  const bool decided = verdict.weighing == Weighing::kDecided;
  const bool weighs = verdict.weighing == Weighing::kWeigh;
  const double weight = robust_weight(residual * residual, verdict.barc * verdict.barc,
                                      decided ? kLargestMu : verdict.mu);
  if (weighs && edge.is_contradicted) edge.is_settled = false;
  edge.is_contradicted = edge.is_settled && decided && weight != edge.weight;
  if (edge.is_settled) {
    sums.kept += edge.weight > 0.5 ? 1 : 0;
    sums.changed += edge.is_contradicted ? 1 : 0;
    return;
  }
  if (weighs) edge.candidate = weight;
  ++sums.open;
  sums.largest = std::max(sums.largest, static_cast<float>(residual));
  if ((decided ? weight : edge.candidate) != edge.weight) ++sums.changed;
  if (edge.candidate != 0.0 && edge.candidate != 1.0) ++sums.fractional;
  sums.kept += edge.candidate > 0.5 ? 1 : 0;
  sums.rejected += edge.is_between && edge.candidate <= 0.5 ? 1 : 0;
}

// Once all weights are decided, the root releases pairs from their limits.
void EdgeWeights::limit_pairs(const TreeVerdict& verdict, const FrontEdges& front,
                              std::span<const SE3> present, TreeSums& sums) {
  const bool decided = verdict.weighing == Weighing::kDecided;
  std::map<std::pair<RobotId, RobotId>, PairPull> pulls;
  for (std::size_t k = 0; k < edges_.size(); ++k) {
    EdgeWeight& weighed = edges_[k];
    const PoseEdge& edge = front.graph().edges[k];
    const std::pair<RobotId, RobotId> pair = std::minmax(edge.from.robot, edge.to.robot);
    const bool released = std::ranges::binary_search(verdict.released, pair);
    weighed.may_be_limited = !decided || (weighed.is_limited && !released);
    if (!decided || !weighed.may_be_limited || weighed.pair_limit == 1.0) continue;
    const EdgeSlot& slot = front.slots()[k];
    const Eigen::Vector3d off =
        present[at(slot.j)].translation() - present[at(slot.i)] * edge.T_from_to.translation();
    PairPull& pull = pulls.try_emplace(pair, PairPull{pair.first, pair.second}).first->second;
    const double counts = weighed.candidate * weighed.pair_limit;
    const double weight = counts * edge.precision.tau;
    pull.sum += (edge.from.robot == pair.first ? weight : -weight) * off;
    pull.weight += weight;
    pull.closures += counts;
  }
  for (const auto& [pair, pull] : pulls) sums.pulls.push_back(pull);
}

void EdgeWeights::doubt(const TreeVerdict& verdict, const FrontEdges& front,
                        std::span<const SE3> poses, const BlockMatrix& inverse) {
  const std::vector<double> weights = in_equations(false);
  for (std::size_t k = 0; k < edges_.size(); ++k) {
    EdgeWeight& edge = edges_[k];
    const EdgeSlot& slot = front.slots()[k];
    if (edge.is_odometry || !slot.couples() || (edge.weight <= 0.5 && !edge.is_doubted)) continue;
    const PoseEdge& closure = front.graph().edges[k];
    const SE3 T_to_from = poses[at(slot.j)].inverse() * poses[at(slot.i)];
    const Index B = inverse.block(), first = first_row_of(B);
    const MatrixXd A_from = adjoint(T_to_from).block(first, first, B, B);
    MatrixXd across = inverse.between(slot.pair);
    if (slot.i > slot.j) across.transposeInPlace();
    across = A_from * across;
    // The covariance is twice the inverse of the second derivatives.
    const MatrixXd of_ends =
        2.0 * (inverse.at(slot.j) + A_from * inverse.at(slot.i) * A_from.transpose() - across -
               across.transpose());
    const auto error =
        error_of(closure, weights[k], se3_log((T_to_from * closure.T_from_to).inverse()), of_ends,
                 verdict.doubt, edge.volume);
    const bool fits = !error || error->claimed <= verdict.barc;
    const bool doubted = edge.is_doubted
                             ? edge.was_lifted || !(fits || error->log_odds > kThousandToOne)
                             : !fits && error->log_odds < 0.0;
    edge.was_lifted = edge.was_lifted || (edge.is_doubted && !doubted);
    doubted_ += doubted != edge.is_doubted ? 1 : 0;
    edge.is_doubted = doubted;
    edge.weight = edge.candidate = doubted ? 0.0 : 1.0;
  }
}

void EdgeWeights::accept() {
  for (EdgeWeight& edge : edges_) {
    edge.weight = edge.candidate;
    edge.is_limited = edge.may_be_limited;
  }
}

std::vector<double> EdgeWeights::in_equations(bool present) const {
  std::vector<double> weights;
  for (const EdgeWeight& edge : edges_) {
    const bool limited = present ? edge.may_be_limited : edge.is_limited;
    const double weight =
        (present ? edge.candidate : edge.weight) * (limited ? edge.pair_limit : 1.0);
    weights.push_back(edge.is_open ? std::max(weight, kFloor) : weight);
  }
  return weights;
}

}  // namespace km
