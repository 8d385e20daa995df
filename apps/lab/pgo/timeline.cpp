#include "apps/lab/pgo/timeline.hpp"

#include <algorithm>

namespace km {
namespace {

std::vector<bool> known_at(const std::vector<Stamp>& stamps, Stamp now) {
  std::vector<bool> known;
  for (const Stamp stamp : stamps) known.push_back(stamp <= now);
  return known;
}

Instant solve_at(const LabelledTeamGraph& team, const std::vector<bool>& odometry, Stamp now,
                 const SolverOptions& options, const TeamMeter& meter) {
  const std::vector<bool> poses = known_at(team.truth.pose_stamps, now);
  const std::vector<bool> edges = known_at(team.truth.edge_stamps, now);
  const std::vector<ConnectedPart> parts = connected_parts(team.graph, poses, edges);
  Instant instant{.poses = static_cast<std::size_t>(std::count(poses.begin(), poses.end(), true)),
                  .parts = parts.size()};
  std::vector<bool> known(edges.size(), false), kept(edges.size(), false);
  std::vector<SolvedPart> solved;
  for (const ConnectedPart& part : parts) {
    if (part.edges.empty()) {  // a single pose
      solved.push_back({part.poses, {SE3::Identity()}});
      continue;
    }
    const Solution solution = solve(part.graph, options, std::nullopt, meter);
    const auto& decision = solution.run.decision;
    instant.decided = instant.decided && (!decision || decision->decided);
    for (std::size_t k = 0; k < part.edges.size(); ++k) {
      known[part.edges[k]] = true;
      kept[part.edges[k]] = !decision || decision->kept[k];
      if (!odometry[part.edges[k]]) ++instant.closures;
    }
    instant.rounds = std::max(instant.rounds, solution.run.rounds.back().round);
    instant.critical_path_s =
        std::max(instant.critical_path_s, solution.run.rounds.back().work.critical_path_s);
    solved.push_back({part.poses, solution.T_world_kf});
  }
  const bool labels = !team.truth.is_false.empty();
  if (labels) instant.counts = count_closures(team, known, kept);
  if (team.truth.T_world_kf.empty()) return instant;
  instant.ate = ate_of(team, solved);
  if (labels) instant.optimum_of_true = ate_of(team, optimum_of_true(team, poses, edges).parts);
  return instant;
}

}  // namespace

std::vector<Instant> play(const LabelledTeamGraph& team, const SolverOptions& options,
                          std::size_t instants, const TeamMeter& meter) {
  const std::vector<Stamp>& poses = team.truth.pose_stamps;
  const std::vector<Stamp>& edges = team.truth.edge_stamps;
  const Stamp first = *std::min_element(poses.begin(), poses.end());
  const Stamp last = std::max(*std::max_element(poses.begin(), poses.end()),
                              *std::max_element(edges.begin(), edges.end()));
  const std::vector<bool> odometry = odometry_edges(team.graph);
  const Stamp step = (last - first) / static_cast<Stamp>(instants);
  std::vector<Instant> played;
  for (std::size_t i = 1; i <= instants; ++i) {
    const Stamp now = i == instants ? last : first + step * static_cast<Stamp>(i);
    played.push_back(solve_at(team, odometry, now, options, meter));
    played.back().after_s = seconds_between(first, now);
  }
  return played;
}

}  // namespace km
