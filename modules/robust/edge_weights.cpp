#include "modules/robust/edge_weights.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "modules/robust/robust_schedule.hpp"

namespace km {
namespace {

using Weighing = TreeVerdict::Weighing;

// Weight of a rejected closure in the equations. Small enough not to bias the solution, positive so
// that the system stays regular.
constexpr double kFloor = 1e-10;
// The closures of a pair pull it if their mean error exceeds kPullOfMean standard deviations of
// this mean, and kPullOfOne standard deviations of a single closure.
constexpr double kPullOfMean = 6.0;
constexpr double kPullOfOne = 1.0;

// The limited pairs whose closures all pull in one direction at the present poses, with a mean that
// noise does not explain.
std::set<RobotId> contradicted_pairs(std::span<const EdgeWeight> edges, const FrontEdges& front,
                                     std::span<const SE3> present, double noise_scale) {
  struct Pull {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    double weight = 0.0;
    double closures = 0.0;  // sum of the weights of the closures
  };
  std::map<RobotId, Pull> pulls;
  for (std::size_t k = 0; k < edges.size(); ++k) {
    if (edges[k].pair_limit == 1.0) continue;
    const PoseEdge& edge = front.graph().edges[k];
    const EdgeSlot& slot = front.slots()[k];
    const Eigen::Vector3d off =
        present[at(slot.j)].translation() - present[at(slot.i)] * edge.T_from_to.translation();
    Pull& pull = pulls[edges[k].peer];
    const double counts = edges[k].candidate * edges[k].pair_limit;
    const double weight = counts * edge.precision.tau;
    pull.sum += (edge.from.robot == front.graph().self ? weight : -weight) * off;
    pull.weight += weight;
    pull.closures += counts;
  }
  std::set<RobotId> contradicted;
  for (const auto& [robot, pull] : pulls) {
    const double most = std::max(kPullOfMean, kPullOfOne * std::sqrt(pull.closures));
    if (pull.sum.norm() > most * noise_scale * std::sqrt(pull.weight)) contradicted.insert(robot);
  }
  return contradicted;
}

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
  limit_pairs(verdict, front, present);
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

// Once all weights are decided, the limit of a pair ends in the first round in which its closures
// no longer all pull in one direction. In earlier rounds even consistent pairs show such a pull,
// because the poses have not converged.
void EdgeWeights::limit_pairs(const TreeVerdict& verdict, const FrontEdges& front,
                              std::span<const SE3> present) {
  std::set<RobotId> contradicted;
  const bool decided = verdict.weighing == Weighing::kDecided;
  if (decided) contradicted = contradicted_pairs(edges_, front, present, verdict.noise_scale);
  for (EdgeWeight& edge : edges_)
    edge.may_be_limited = !decided || (edge.is_limited && contradicted.contains(edge.peer));
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
