#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "apps/lab/experiments/experiment_plan.hpp"
#include "modules/charts/plot.hpp"

namespace km {

/// Error of a mesh, and its right labels; values without a measurement are absent.
struct MeshNumbers {
  std::optional<double> error_m;       ///< Error of the paper: from every true point within reach.
  std::optional<double> seen_error_m;  ///< Without true surface that no robot can have seen.
  std::optional<double> labels_percent;  ///< Right labels, at the points of error_m.
  std::optional<double> seen_labels_percent;
  std::optional<double> back_error_m;  ///< From every point of the mesh to the true one.
};

/// The mesh as odometry built it, and after its correction.
struct MeshPair {
  MeshNumbers before, after;
};

/// Results of a robot in a team's run.
struct RobotNumbers {
  std::string name;
  double recorded_s = 0.0;  ///< Length of its recording.
  double distance_m = 0.0;  ///< True length of its path; 0 without a truth.
  std::size_t keyframes = 0;
  bool in_team_frame = true;  ///< False if it never joined the others.
  std::optional<double> odometry_error_m, optimized_error_m;  ///< Absolute trajectory errors
                                                              ///< (RMSE).
  std::map<std::string, double> sent_bytes;                   ///< Sent bytes by category.
  std::optional<double> keyframe_bytes;                       ///< Mean size with all its keypoints.
  double peer_keyframes = 0.0, peer_keypoints = 0.0;          ///< See PeerKeyframeCounts.
  std::optional<double> processor_s;                          ///< CPU time of the whole robot.
  std::optional<double> peak_memory_mb;
  std::map<std::string, double> module_s;  ///< Time in the steps of each module, waiting excluded.
  MeshPair mesh;
};

/// A team's run in a world.
struct WorldResults {
  std::vector<RobotNumbers> robots;
  std::optional<double> joint_error_m;            ///< As published, under one alignment.
  std::optional<double> live_error_m;             ///< As known when each image came.
  MeshPair mesh;                                  ///< Mesh of all robots together.
  std::optional<double> closures, true_closures;  ///< Number of kept closures.
  std::string images;                             ///< "752x480, 90 s, seed 1".
  std::size_t image_pixels = 0;                   ///< Pixels of one camera.

  [[nodiscard]] std::size_t keyframes() const;
  /// Sum over the robots [MB]; nothing for a category that no robot sent.
  [[nodiscard]] double sent_mb(const std::string& category) const;
  /// Sum over the robots and all categories but the map [MB].
  [[nodiscard]] double counted_mb() const;
  /// Bytes of all keyframes at a server [MB], with as many keypoints as the robots receive of a
  /// keyframe in the mean. 0 if they received none.
  [[nodiscard]] double equal_keypoints_mb() const;
};

/// Length of the recording, processor time, memory and modules of a robot that ran alone, from its
/// results folder. Throws std::runtime_error, as below.
[[nodiscard]] RobotNumbers read_lone_robot(const std::filesystem::path& run);

/// Reads the team's tables and the results of the robots. Throws std::runtime_error naming the file
/// that is missing or invalid.
[[nodiscard]] WorldResults read_world_results(const WorldConfig& world,
                                              const ExperimentPaths& paths);

/// Result of an optimisation method on the team's graph. It is finished in the first round whose
/// cost is within kFinishedGap of its last, because a limit on rounds says nothing about the
/// method. A method that rejects closures is finished when it has decided; it has no cost here.
struct PgoNumbers {
  static constexpr double kFinishedGap = 1e-6;  ///< Relative.

  std::size_t poses = 0, edges = 0;
  std::size_t rounds = 0;  ///< Rounds until finished.
  double bytes = 0.0;      ///< Sent by all robots until then.
  double seconds = 0.0;    ///< CPU time of the slowest robot of each exchange until then, summed.
  double cost = 0.0;     ///< Final cost of the rigid poses; NaN for a method that rejects closures.
  double optimum = 0.0;  ///< Certified optimum; or NaN.
  std::optional<double> error_m;  ///< Absolute trajectory error of all keyframes, rmse.
  std::optional<Plot> plot;       ///< Trajectories from above.
};

/// Throws std::runtime_error, as above.
[[nodiscard]] PgoNumbers read_pgo_numbers(const WorldConfig& world, const PgoMethodConfig& method,
                                          const ExperimentPaths& paths);

}  // namespace km
