#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "apps/pgo/closure_noise.hpp"
#include "modules/outlier_rejection/pcm_config.hpp"
#include "modules/pose_graph/robust/gnc_agent.hpp"
#include "modules/pose_graph/team/round_meter.hpp"
#include "modules/pose_graph/team/team_graph.hpp"

namespace km {

/// How false closures are kept out.
enum class Rejection {
  kNone,
  kPcm,     ///< Pairwise consistency by robot pair, then Newton steps, from odometry.
  kGnc,     ///< Graduated non-convexity of the team, StagedGncTeam.
  kPcmGnc,  ///< The same on what pairwise consistency leaves, as in the robot.
};

[[nodiscard]] const char* to_string(Rejection method);

struct OutlierStudyOptions {
  std::vector<double> shares_percent;  ///< False closures for every 100 true ones.
  std::vector<Rejection> methods;
  std::vector<unsigned> seeds = {1};
  double half_side_m = 0.0;  ///< Of the false ones' translations, see spoil(); 0: as the map's.
  PcmConfig pcm = {};
  GncAgentOptions gnc = {};  ///< barc 0: default_barc().
  NoiseModel noise = {};     ///< Scales what both reject by.
  int max_rounds = 300;
};

/// What one method made of one spoiled graph.
struct OutlierResult {
  Rejection method = Rejection::kNone;
  double share_percent = 0.0;
  unsigned seed = 0;
  std::size_t false_closures = 0;
  std::size_t true_kept = 0;
  std::size_t false_kept = 0;
  double noise_scale = 1.0;  ///< As used; where it is estimated, from the spoiled graph.
  double rmse_m = 0.0;       ///< Of positions to the optimum of the clean graph, rigidly aligned.
  int rounds = 0;
  bool decided = true;    ///< False: max_rounds did not suffice.
  std::size_t bytes = 0;  ///< Sent by the solver; closures are known to their two robots anyway.
  double cpu_s = 0.0;     ///< Of all robots, pairwise consistency included.
};

struct OutlierStudy {
  std::size_t robots = 0;
  std::size_t poses = 0;
  std::size_t true_closures = 0;
  bool certified = false;              ///< The optimum of the clean graph is.
  double half_side_m = 0.0;            ///< As used.
  std::vector<OutlierResult> results;  ///< By share, method, seed.
};

/// Called with the number of runs done, and that of all.
using OutlierProgress = std::function<void(std::size_t, std::size_t)>;

/// Throws std::invalid_argument if graph or options are not usable.
[[nodiscard]] OutlierStudy run_outlier_study(const TeamGraph& clean,
                                             const OutlierStudyOptions& options,
                                             const TeamMeter& meter,
                                             const OutlierProgress& progress = {});

}  // namespace km
