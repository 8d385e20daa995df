#pragma once

#include <iosfwd>
#include <string>
#include <vector>

#include "apps/pgo/closure_noise.hpp"
#include "modules/pose_graph/robust/gnc_agent.hpp"
#include "modules/pose_graph/team/team_graph.hpp"
#include "modules/pose_graph/team/team_solver.hpp"

namespace km {

/// What distributed graduated non-convexity made of one graph.
struct RobustRun {
  std::vector<TeamRound> rounds;  ///< [0]: the start. Costs are of all edges, unweighted.
  std::vector<bool> kept;         ///< Of the graph's edges.
  std::vector<bool> odometry;     ///< Likewise.
  std::vector<SE3> T_world_kf;
  double barc = 0.0;  ///< In sigmas of the graph times noise.scale.
  NoiseModel noise_model;
  ClosureNoise noise;
  int updates = 0;
  std::size_t isolated = 0;  ///< Closures that stood aside at first, see StagedGncTeam.
  bool decided = false;      ///< Else the rounds did not suffice.
};

/// Throws std::invalid_argument if options or graph are not usable.
[[nodiscard]] RobustRun run_robust(const TeamGraph& graph, GncAgentOptions options,
                                   const NoiseModel& noise, int max_rounds, const TeamMeter& meter);

/// Where more than a tenth of the closures are rejected and the graph was believed, a hint at what
/// may be the reason.
[[nodiscard]] std::string robust_text(const TeamGraph& graph, const RobustRun& run);

/// {"poses", "edges", "robots", "robust", "barc", "scale", "scaled_barc", "updates", "isolated",
/// "decided", "kept": [indices of edges], "rounds": [{"bytes", "critical_path_s", "total_cpu_s"}]};
/// sums up to the round. The threshold is barc sigmas of closures, or scaled_barc = scale barc
/// sigmas of the graph.
void write_robust_json(std::ostream& out, const TeamGraph& graph, const RobustRun& run);

}  // namespace km
