#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "apps/lab/pgo/round_meter.hpp"
#include "apps/lab/pgo/scenario.hpp"
#include "modules/outlier_rejection/pcm_config.hpp"

namespace km {

/// Methods against false closures:
/// - robots: the robots' own code at its defaults, see run_agent_team();
/// - pcm: the closures that pairwise consistency keeps, by Newton's method on one computer;
/// - trust-all: all closures, on one computer;
/// - reference: only the true closures, all edges weighed by the noise that was drawn, on one
///   computer, started at the truth: the best achievable result.
inline const std::vector<std::string> kRejections = {"robots", "pcm", "trust-all", "reference"};

struct OutlierStudyOptions {
  std::optional<Scenario> scenario = {};  ///< nullopt: the measurements of the graph.
  /// False closures for every 100 true ones. Empty: the share of the scenario.
  std::vector<double> shares_percent = {};
  std::vector<std::string> methods = {};  ///< Names from kRejections.
  std::vector<unsigned> seeds = {1};
  PcmConfig pcm = {};
};

/// Result of one method on one graph with false closures.
struct OutlierResult {
  std::string method = {};
  double share_percent = 0.0;
  unsigned seed = 0;
  std::size_t true_closures = 0;
  std::size_t true_lost = 0;
  std::size_t between = 0;  ///< True closures between two robots.
  std::size_t between_lost = 0;
  std::size_t false_closures = 0;
  std::size_t false_kept = 0;
  std::size_t frames = 1;  ///< Number of separate frames in the result.
  /// Errors of positions. Each frame of the result is aligned to the truth by one rigid transform.
  double rms_m = 0.0;
  double max_m = 0.0;
  std::size_t rounds = 0;  ///< Also `bytes`: 0 for methods on one computer.
  std::size_t bytes = 0;   ///< Sent by all robots.
  bool decided = true;     ///< False: the method did not end.
  double cpu_s = 0.0;      ///< CPU time of all robots.
};

struct OutlierStudy {
  std::string scenario;  ///< Empty: the measurements of the graph.
  std::size_t robots = 0;
  std::size_t poses = 0;
  bool certified = false;              ///< Whether the optimum that is the truth is certified.
  std::vector<OutlierResult> results;  ///< Ordered by share, then method, then seed.
};

/// Called with the number of finished runs and the number of all runs.
using OutlierProgress = std::function<void(std::size_t, std::size_t)>;

/// The truth is the optimum of `clean`, which has no false closures and no verticals. Throws
/// std::invalid_argument if graph or options are not usable.
[[nodiscard]] OutlierStudy run_outlier_study(const TeamGraph& clean,
                                             const OutlierStudyOptions& options,
                                             const TeamMeter& meter,
                                             const OutlierProgress& progress = {});

/// By edge: whether pairwise consistency maximisation keeps the edge. It keeps all odometry, and
/// the largest set of closures that agree pairwise, separately for each pair of robots and inside
/// each robot (see Pcm). Closures come in the order of the edges. A second closure from the same
/// pose to the same pose is dropped. Throws as Pcm does.
[[nodiscard]] std::vector<bool> pairwise_consistent(const TeamGraph& graph,
                                                    const PcmConfig& config);

/// Poses estimated by a method, and the edges that it uses.
struct PlacedTeam {
  std::vector<SE3> T_frame_kf;
  std::vector<Eigen::Index> frame_of;  ///< By pose; poses of one frame have the same number.
  std::vector<bool> kept;              ///< By edge.
  bool decided = true;
  std::size_t rounds = 0;  ///< See OutlierResult; also `bytes`.
  std::size_t bytes = 0;
};

/// Returns the minimum of the `kept` edges near `start`, after at most 300 Newton steps on one
/// computer. Parts that these edges leave unconnected are solved separately, each in a frame of
/// its own.
[[nodiscard]] PlacedTeam solve_centrally(const TeamGraph& graph, std::vector<bool> kept,
                                         std::vector<SE3> start);

/// Counts closures lost and kept, and computes the errors of `placed`. Method, share, seed and time
/// are not set.
[[nodiscard]] OutlierResult judge(const ScenarioGraph& drawn, const PlacedTeam& placed);

}  // namespace km
