#include "modules/pose_graph/precision_limits.hpp"

#include <algorithm>
#include <vector>

#include "modules/pose_graph/pair_consensus.hpp"

namespace km {
namespace {

// Largest weights, relative to a step of the lower median robot. A closure may have half the sigma
// of that step. The errors of odometry add up, so the limit on the mean step of a robot is
// stricter.
constexpr double kMostPrecise = 4.0;
constexpr double kBestOdometry = 1.25;
constexpr std::size_t kMajority = 3;

}  // namespace

void limit_precisions(SessionGraph& graph) {
  if (graph.step_precision.size() < kMajority) return;
  const Precision own = graph.step_precision[graph.self];
  std::vector<Precision> steps;
  for (const auto& [robot, step] : graph.step_precision) steps.push_back(step);
  const Precision usual = lower_median(steps);
  const auto limited = [&](const Precision& p) {
    return Precision{std::min(p.kappa, kMostPrecise * usual.kappa),
                     std::min(p.tau, kMostPrecise * usual.tau)};
  };
  for (auto* edges : {&graph.own, &graph.fixes})
    for (PoseEdge& e : *edges) {
      e.precision.kappa *= std::min(1.0, kBestOdometry * usual.kappa / own.kappa);
      e.precision.tau *= std::min(1.0, kBestOdometry * usual.tau / own.tau);
    }
  for (auto* edges : {&graph.between, &graph.to_absent})
    for (PoseEdge& e : *edges) e.precision = limited(e.precision);
  for (auto& [robot, step] : graph.step_precision) step = limited(step);
}

}  // namespace km
