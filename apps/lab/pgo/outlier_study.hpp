#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "apps/lab/pgo/solvers.hpp"
#include "apps/lab/pgo_study/round_meter.hpp"
#include "apps/lab/pgo_study/team_graph.hpp"
#include "modules/evaluation/trajectory_error.hpp"
#include "modules/outlier_rejection/pcm_config.hpp"

namespace km {

/// By edge: whether pairwise consistency maximisation keeps it. It keeps odometry. From the
/// closures between two robots, or inside one, it keeps the largest set that agrees pairwise, see
/// Pcm. Closures come in the order of the edges. A second closure from the same pose to the same
/// pose is dropped. The sigmas of all edges are `noise_scale` times those of the graph. Throws
/// std::invalid_argument if a robot's odometry is interrupted, and as Pcm does.
[[nodiscard]] std::vector<bool> pairwise_consistent(const TeamGraph& graph, const PcmConfig& config,
                                                    double noise_scale = 1.0);

/// Methods against false closures: none; pairwise consistency; newton; newton on the closures that
/// pairwise consistency keeps. The first two end with newton --trust-all.
inline const std::vector<std::string> kRejections = {"none", "pcm", "newton", "pcm+newton"};

/// False closures that agree with one another within their noise, as between aisles of the same
/// appearance. Each cluster joins successive poses of one robot to successive poses of another.
struct Clusters {
  std::size_t places = 0;  ///< Number of clusters, all between the same two robots.
  std::size_t size = 5;    ///< Closures in each.
};

struct OutlierStudyOptions {
  std::vector<double> shares_percent;  ///< False closures for every 100 true ones.
  std::vector<std::string> methods;    ///< Names from kRejections.
  std::vector<unsigned> seeds = {1};
  double half_side_m = 0.0;  ///< Range of the translations of false closures; 0: half the extent of
                             ///< the map.
  PcmConfig pcm = {};
  double pcm_sigmas = 1.0;  ///< Sigmas of all edges, as a multiple of the graph's.
  double barc = 0.0;        ///< See SolverOptions.
  Clusters clusters = {};   ///< Clusters in addition to random false closures.
  int max_rounds = 300;
};

/// Result of one method on one graph with false closures.
struct OutlierResult {
  std::string method;
  double share_percent = 0.0;
  unsigned seed = 0;
  std::size_t false_closures = 0;
  std::size_t true_kept = 0;
  std::size_t false_kept = 0;
  double noise_scale = 1.0;  ///< Noise scale of closures, as estimated by newton.
  double rmse_m = 0.0;       ///< RMSE of positions against the optimum of the clean graph, aligned.
  int rounds = 0;
  bool decided = true;    ///< False: max_rounds did not suffice.
  std::size_t bytes = 0;  ///< Sent by the solver. The two robots of a closure know it without a
                          ///< message.
  double cpu_s = 0.0;     ///< CPU time of all robots, pairwise consistency included.
};

struct OutlierStudy {
  std::size_t robots = 0;
  std::size_t poses = 0;
  std::size_t true_closures = 0;
  bool certified = false;              ///< Whether the optimum of the clean graph is certified.
  double half_side_m = 0.0;            ///< Range of the false translations that was used.
  std::vector<OutlierResult> results;  ///< Ordered by share, method, seed.
};

/// Called with the number of finished runs and the number of all runs.
using OutlierProgress = std::function<void(std::size_t, std::size_t)>;

/// Throws std::invalid_argument if graph or options are not usable. The graph has no verticals.
[[nodiscard]] OutlierStudy run_outlier_study(const TeamGraph& clean,
                                             const OutlierStudyOptions& options,
                                             const TeamMeter& meter,
                                             const OutlierProgress& progress = {});

/// Distances of the positions of `pairs`, after the estimate is aligned by one rigid transform.
[[nodiscard]] std::vector<double> aligned_errors_m(std::span<const PosePair> pairs);

/// Half the longest side of the box around all positions.
[[nodiscard]] double half_extent_m(const std::vector<SE3>& poses);

/// Appends `count` false closures to the edges. Each joins a uniformly drawn pair of poses that do
/// not follow each other. Its rotation is uniform, and its translation is uniform within
/// +-half_side_m along every axis (both in the plane for planar graphs). It claims the weights of a
/// true closure drawn at random. Throws std::invalid_argument if `graph` has no closures to draw
/// from.
[[nodiscard]] TeamGraph corrupt(const TeamGraph& graph, std::size_t count, double half_side_m,
                                unsigned seed);

/// False closures from poses a, a + 1, ... of one robot to poses b, b + 1, ... of another. They
/// agree with the motion of `poses` and with `T_a_b` between the first two.
[[nodiscard]] std::vector<BlockEdge> false_place(const std::vector<SE3>& poses, Eigen::Index a,
                                                 Eigen::Index b, std::size_t size, const SE3& T_a_b,
                                                 const Precision& claimed);

/// Appends clusters of false closures between the first robot and the last. `poses` give the motion
/// of the robots within a cluster. Weights and ranges are as in `corrupt`. Throws
/// std::invalid_argument if a robot has fewer poses than a cluster has closures.
[[nodiscard]] TeamGraph corrupt_in_clusters(const TeamGraph& graph, const Clusters& clusters,
                                            const std::vector<SE3>& poses, double half_side_m,
                                            unsigned seed);

}  // namespace km
