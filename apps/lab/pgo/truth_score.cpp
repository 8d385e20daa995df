#include "apps/lab/pgo/truth_score.hpp"

#include <cmath>
#include <limits>
#include <numeric>

#include "apps/lab/pgo/solvers.hpp"
#include "modules/evaluation/trajectory_error.hpp"

namespace km {
std::vector<ConnectedPart> true_parts(const LabelledTeamGraph& team) {
  std::vector<bool> keep_edge = team.truth.is_false;
  keep_edge.flip();
  return connected_parts(team.graph, keep_edge);
}

TrueOptimum optimum_of_true(const LabelledTeamGraph& team) {
  TrueOptimum optimum;
  for (const ConnectedPart& part : true_parts(team)) {
    if (part.edges.empty()) {  // a single pose
      optimum.parts.push_back({part.poses, {SE3::Identity()}});
      continue;
    }
    const CentralOptimum solved = central_optimum(part.graph);
    optimum.parts.push_back({part.poses, solved.poses});
    optimum.certified = optimum.certified && solved.certificate.certified;
  }
  return optimum;
}

LabelCounts count_closures(const TeamGraph& graph, const std::vector<bool>& is_false,
                           const std::vector<bool>& kept) {
  const std::vector<bool> odometry = odometry_edges(graph);
  LabelCounts counts;
  for (std::size_t k = 0; k < odometry.size(); ++k) {
    if (odometry[k]) continue;
    const bool inside = graph.robot_of(graph.edges[k].i) == graph.robot_of(graph.edges[k].j);
    ClosureCounts& count = inside ? counts.inside : counts.between;
    if (!is_false.empty() && is_false[k])
      ++(kept[k] ? count.false_kept : count.false_rejected);
    else
      ++(kept[k] ? count.true_kept : count.true_lost);
  }
  return counts;
}

TeamAte ate_of(const LabelledTeamGraph& team, const std::vector<SolvedPart>& parts) {
  double sum_m2 = 0.0;
  std::size_t poses = 0;
  for (const SolvedPart& part : parts) {
    std::vector<PosePair> pairs;
    for (std::size_t i = 0; i < part.poses.size(); ++i)
      if (const auto& truth = team.truth.T_world_kf[part.poses[i]])
        pairs.push_back({.T_truth_body = *truth, .T_estimate_body = part.T_world_kf[i]});
    if (pairs.empty()) continue;
    for (const double error_m : aligned_errors_m(pairs)) sum_m2 += error_m * error_m;
    poses += pairs.size();
  }
  return {.team_m = poses > 0 ? std::sqrt(sum_m2 / static_cast<double>(poses))
                              : std::numeric_limits<double>::quiet_NaN(),
          .parts = parts.size()};
}

TruthScore score(const LabelledTeamGraph& team, const std::vector<SE3>& T_world_kf,
                 std::vector<bool> kept) {
  TruthScore score;
  const bool labels = !team.truth.is_false.empty();
  if (kept.empty()) kept.assign(team.graph.edges.size(), true);
  if (labels) score.closures = count_closures(team.graph, team.truth.is_false, kept);
  if (team.truth.T_world_kf.empty()) return score;
  SolvedPart whole{std::vector<std::size_t>(T_world_kf.size()), T_world_kf};
  std::iota(whole.poses.begin(), whole.poses.end(), std::size_t{0});
  score.ate = ate_of(team, {std::move(whole)});
  if (!labels) return score;
  const TrueOptimum optimum = optimum_of_true(team);
  score.optimum_of_true = ate_of(team, optimum.parts);
  score.certified = optimum.certified;
  return score;
}

}  // namespace km
