#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "apps/lab/pgo/outlier_study.hpp"
#include "apps/lab/pgo/scenario.hpp"
#include "apps/lab/pgo_study/round_meter.hpp"

namespace km {

/// Methods by which a scenario is solved:
///     robots     by the robots' own code at its defaults, see run_agent_team();
///     trust-all  all closures, with the claimed noise, by Newton's method on one computer;
///     pcm        the closures that pairwise consistency keeps, otherwise as trust-all;
///     gnc        graduated non-convexity on one computer, see solve_by_gnc();
///     reference  only the true closures, all edges weighed by the noise that was drawn, on one
///                computer, started at the truth: the best achievable result.
inline const std::vector<std::string> kScenarioMethods = {"robots", "trust-all", "pcm", "gnc",
                                                          "reference"};

struct ScenarioStudyOptions {
  Scenario scenario = {};
  std::vector<std::string> methods = kScenarioMethods;
  std::vector<unsigned> seeds = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10};
  PcmConfig pcm = {};
  double keyframes_per_s = 0.0;  ///< Only for robots: see AgentTeamOptions.
  /// Thresholds of robots, pcm and gnc [sigma of the claimed noise], for a receiver operating
  /// characteristic: each of these methods runs once with each threshold. A closure, or with pcm a
  /// cycle, is consistent up to this Mahalanobis distance. 0: the default of the method.
  std::vector<double> thresholds = {0.0};
};

/// Result of one method for one drawn scenario.
struct ScenarioResult {
  std::string method = {};
  unsigned seed = 0;
  double threshold = 0.0;  ///< [sigma]; 0: the default of the method, or it has none.
  std::size_t true_closures = 0;
  std::size_t true_lost = 0;
  std::size_t between = 0;  ///< True closures between two robots.
  std::size_t between_lost = 0;
  std::size_t false_closures = 0;
  std::size_t false_kept = 0;
  std::size_t frames = 1;     ///< Number of separate frames in the result.
  std::size_t tentative = 0;  ///< Number of robots joined tentatively, see FrameTies.
  /// Errors of positions. Each frame of the result is aligned to the truth by one rigid transform.
  double rms_m = 0.0;
  double max_m = 0.0;
  bool decided = true;  ///< False: the method did not end.
  double cpu_s = 0.0;
};

struct ScenarioStudy {
  std::string scenario;
  std::size_t robots = 0;
  std::size_t poses = 0;
  bool certified = false;               ///< Whether the optimum that is the truth is certified.
  std::vector<ScenarioResult> results;  ///< Ordered by seed, then method, then threshold.
};

/// Throws std::invalid_argument if graph or options are not usable.
[[nodiscard]] ScenarioStudy run_scenario_study(const TeamGraph& whole,
                                               const ScenarioStudyOptions& options,
                                               const TeamMeter& meter,
                                               const OutlierProgress& progress = {});

/// Poses estimated by a method, and the edges that it uses.
struct PlacedTeam {
  std::vector<SE3> T_frame_kf;
  std::vector<Eigen::Index> frame_of;  ///< By pose; poses of one frame have the same number.
  std::vector<bool> kept;              ///< By edge.
  bool decided = true;
  std::size_t tentative = 0;  ///< See ScenarioResult.
};

/// Returns the minimum of the `kept` edges near `start`, after at most `most_steps` Newton steps on
/// one computer. Parts that these edges leave unconnected are solved separately, each in a frame of
/// its own.
[[nodiscard]] PlacedTeam solve_centrally(const TeamGraph& graph, std::vector<bool> kept,
                                         std::vector<SE3> start, std::uint32_t most_steps = 300);

/// Graduated non-convexity with truncated least squares at a fixed scale (Yang et al., "Graduated
/// Non-Convexity for Robust Spatial Perception", RA-L 2020, Algorithm 1). Closures are rejected if
/// their residual exceeds `threshold` [sigma of the claimed noise]; 0: that of the 99 % quantile of
/// chi-squared with 6 degrees of freedom.
/// Odometry is trusted. The start is odometry_start(), or chordal if closures do not join all
/// robots. Each change of the weights is followed by at most 20 Newton steps.
[[nodiscard]] PlacedTeam solve_by_gnc(const TeamGraph& graph, double threshold = 0.0);

/// Counts closures lost and kept, and computes the errors of `placed`. Method, seed and time are
/// not set.
[[nodiscard]] ScenarioResult judge(const ScenarioGraph& drawn, const PlacedTeam& placed);

}  // namespace km
