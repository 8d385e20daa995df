#pragma once

#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

#include "modules/pose_graph/robust/gnc_agent.hpp"
#include "modules/pose_graph/robust/noise_scale.hpp"
#include "modules/pose_graph/team/team_graph.hpp"
#include "modules/pose_graph/team/team_solver.hpp"

namespace km {

/// What sigmas of closures the threshold is a multiple of.
enum class NoiseModel {
  kNominal,    ///< Those of the graph.
  kLarger,     ///< Those of noise_scale(), if larger.
  kEstimated,  ///< Those of noise_scale().
};

/// What distributed graduated non-convexity made of one graph.
struct RobustRun {
  std::vector<TeamRound> rounds;  ///< [0]: the start. Costs are of all edges, unweighted.
  std::vector<bool> kept;         ///< Of the graph's edges.
  std::vector<bool> odometry;     ///< Likewise.
  std::vector<SE3> T_world_kf;
  double barc = 0.0;  ///< In sigmas of the graph times scale.
  double scale = 1.0;
  std::optional<NoiseScale> noise;  ///< As estimated; nullopt: not asked for, or too few closures.
  int updates = 0;
  std::size_t isolated = 0;  ///< Closures that stood aside at first, see StagedGncTeam.
  bool decided = false;      ///< Else the rounds did not suffice.
};

/// Throws std::invalid_argument if options or graph are not usable.
[[nodiscard]] RobustRun run_robust(const TeamGraph& graph, GncAgentOptions options,
                                   NoiseModel noise, int max_rounds, const TeamMeter& meter);

[[nodiscard]] std::string robust_text(const TeamGraph& graph, const RobustRun& run);

/// {"poses", "edges", "robots", "robust", "barc", "scale", "updates", "isolated", "decided",
/// "kept": [indices of edges], "rounds": [{"bytes", "critical_path_s", "total_cpu_s"}]}; sums up to
/// the round.
void write_robust_json(std::ostream& out, const TeamGraph& graph, const RobustRun& run);

}  // namespace km
