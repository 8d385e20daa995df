#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "apps/pgo/solvers.hpp"
#include "modules/outlier_rejection/pcm_config.hpp"
#include "modules/pgo_study/round_meter.hpp"
#include "modules/pgo_study/team_graph.hpp"

namespace km {

/// Which edges of a graph pairwise consistency maximisation keeps: odometry, and of the closures
/// between two robots, or inside one, the largest set that agrees pairwise, see Pcm. Closures come
/// in the order of the edges; a second one from the same pose to the same pose is dropped. Sigmas
/// of all edges are taken to be `noise_scale` times those of the graph.
/// Throws std::invalid_argument if a robot's odometry is interrupted, and as Pcm does.
[[nodiscard]] std::vector<bool> pairwise_consistent(const TeamGraph& graph, const PcmConfig& config,
                                                    double noise_scale = 1.0);

/// How false closures are kept out: not at all; by pairwise consistency; by newton; by newton on
/// what pairwise consistency leaves. The first two end with newton --trust-all.
inline const std::vector<std::string> kRejections = {"none", "pcm", "newton", "pcm+newton"};

/// False closures that agree with one another within their noise, as those between aisles that look
/// alike do: each cluster joins successive poses of one robot to successive ones of another.
struct Clusters {
  std::size_t places = 0;  ///< So many of them, all between one pair of robots.
  std::size_t size = 5;    ///< Closures in each.
};

struct OutlierStudyOptions {
  std::vector<double> shares_percent;  ///< False closures for every 100 true ones.
  std::vector<std::string> methods;    ///< Of kRejections.
  std::vector<unsigned> seeds = {1};
  double half_side_m = 0.0;  ///< Of the false ones' translations, see spoil(); 0: as the map's.
  PcmConfig pcm = {};
  double pcm_sigmas = 1.0;  ///< Sigmas of all edges, in multiples of the graph's.
  double barc = 0.0;        ///< See SolverOptions.
  Clusters clusters = {};   ///< Beside the others.
  int max_rounds = 300;
};

/// What one method made of one spoiled graph.
struct OutlierResult {
  std::string method;
  double share_percent = 0.0;
  unsigned seed = 0;
  std::size_t false_closures = 0;
  std::size_t true_kept = 0;
  std::size_t false_kept = 0;
  double noise_scale = 1.0;  ///< Of closures, as newton has found it.
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

/// Throws std::invalid_argument if graph or options are not usable. The graph has no verticals.
[[nodiscard]] OutlierStudy run_outlier_study(const TeamGraph& clean,
                                             const OutlierStudyOptions& options,
                                             const TeamMeter& meter,
                                             const OutlierProgress& progress = {});

/// Half the longest side of the box around all positions.
[[nodiscard]] double half_extent_m(const std::vector<SE3>& poses);

/// Adds `count` false closures after the graph's own edges: between uniform pairs of poses that do
/// not follow each other, with uniform rotations and translations uniform within +-half_side_m
/// along every axis (in the plane: both). Each claims the weights of a true closure drawn at
/// random. Throws std::invalid_argument if `graph` has no closures to draw from.
[[nodiscard]] TeamGraph spoil(const TeamGraph& graph, std::size_t count, double half_side_m,
                              unsigned seed);

/// Adds clusters of false closures, between the first robot and the last; `poses` say how the
/// robots moved meanwhile. Otherwise as spoil(). Throws std::invalid_argument if a robot has not as
/// many poses as a cluster closures.
[[nodiscard]] TeamGraph spoil_in_clusters(const TeamGraph& graph, const Clusters& clusters,
                                          const std::vector<SE3>& poses, double half_side_m,
                                          unsigned seed);

}  // namespace km
