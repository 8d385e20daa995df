#include "modules/robust/edge_weights.hpp"

#include <algorithm>
#include <map>

#include "modules/robust/robust_schedule.hpp"

namespace km {
namespace {

using Weighing = TreeVerdict::Weighing;

// Weight of a rejected closure in the equations. Small enough not to bias the solution, positive so
// that the system stays regular.
constexpr double kFloor = 1e-10;

}  // namespace

void EdgeWeights::unsettle() {
  for (EdgeWeight& edge : edges_) {
    edge.is_settled = false;
    edge.weight = edge.candidate = 1.0;
  }
}

void EdgeWeights::weigh(const TreeVerdict& verdict, const FrontEdges& front,
                        std::span<const SE3> present, TreeSums& sums) {
  for (std::size_t k = 0; k < edges_.size(); ++k) {
    EdgeWeight& edge = edges_[k];
    edge.candidate = edge.weight;
    if (edge.is_open) {
      const EdgeSlot& slot = front.slots()[k];
      weigh_open(edge, verdict,
                 residual_of(front.graph().edges[k], present[at(slot.i)], present[at(slot.j)]),
                 sums);
    } else {
      sums.kept += edge.is_odometry ? 0 : 1;
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
