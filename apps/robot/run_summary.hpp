#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "modules/core/data/pose_graph.hpp"
#include "modules/core/data/stamped_pose.hpp"
#include "modules/core/ids.hpp"
#include "modules/core/io/json.hpp"
#include "modules/diagnosis/finding.hpp"
#include "modules/vio/vio_statistics.hpp"

namespace km {

/// Calls visitor.field(name, value) for each name and the value behind it.
void visit_each(auto& visitor, const char* name, auto& value, auto&... more) {
  visitor.field(name, value);
  if constexpr (sizeof...(more) > 0) visit_each(visitor, more...);
}

/// Number of closures by the stage they reached; each number includes the next.
struct ClosureCounts {
  std::uint64_t candidates = 0;
  std::uint64_t verified = 0;
  std::uint64_t inliers = 0;

  void visit_fields(auto& visitor) {
    visit_each(visitor, "candidates", candidates, "verified", verified, "inliers", inliers);
  }
  bool operator==(const ClosureCounts&) const = default;
};

/// Keyframes of peers whose features this robot received, with the keypoints of all of them.
struct PeerKeyframeCounts {
  std::uint64_t keyframes = 0;
  std::uint64_t keypoints = 0;

  void visit_fields(auto& visitor) {
    visit_each(visitor, "keyframes", keyframes, "keypoints", keypoints);
  }
  bool operator==(const PeerKeyframeCounts&) const = default;
};

/// The state of the team's optimiser, as this robot knows it.
void visit_fields(OptimizerProgress& pgo, auto& visitor) {
  visit_each(visitor, "rounds", pgo.round, "seconds", pgo.seconds, "cost", pgo.cost,
             "gradient_norm", pgo.gradient_norm, "anchor", pgo.anchor, "settled", pgo.settled,
             "members", pgo.members, "tentative", pgo.tentative, "not_joined", pgo.not_joined,
             "odometry_rotation_noise", pgo.odometry_rotation_noise, "odometry_translation_noise",
             pgo.odometry_translation_noise, "odometry_breaks", pgo.odometry_breaks);
}

/// Frames that went into the map, reasons for skipped ones, and size of the final mesh.
struct MappingSummary {
  std::uint64_t frames = 0;
  std::uint64_t dropped_under_load = 0;  ///< Frames left out because processors were short.
  std::uint64_t skipped_wrong_size = 0, skipped_bad_pose = 0, skipped_too_late = 0;
  std::uint64_t without_labels = 0, label_pixels_outside_palette = 0;
  std::uint64_t blocks_refused =
      0;  ///< Requests for blocks that the map refused, over all frames (see NearBlocks).
  std::uint64_t blocks = 0, vertices = 0, faces = 0, superseded_faces_dropped = 0;
  std::uint64_t corrections = 0;
  double correction_seconds = 0.0;
  std::uint64_t unbound_vertices = 0;  ///< In the last correction.

  void visit_fields(auto& visitor) {
    visit_each(visitor, "frames", frames, "dropped_under_load", dropped_under_load,
               "skipped_wrong_size", skipped_wrong_size, "skipped_bad_pose", skipped_bad_pose,
               "skipped_too_late", skipped_too_late, "without_labels", without_labels,
               "label_pixels_outside_palette", label_pixels_outside_palette, "blocks_refused",
               blocks_refused, "blocks", blocks, "vertices", vertices, "faces", faces,
               "superseded_faces_dropped", superseded_faces_dropped, "corrections", corrections,
               "correction_seconds", correction_seconds, "unbound_vertices", unbound_vertices);
  }
};

/// Sums by category of the traffic.
struct TrafficSums {
  std::map<std::string, std::uint64_t> messages, bytes;

  void visit_fields(auto& visitor) { visit_each(visitor, "messages", messages, "bytes", bytes); }
};

/// Messages that the budget held back, each counted once: see HeldBack of the runtime.
struct HeldBackSums {
  TrafficSums delayed, superseded, dropped;

  void visit_fields(auto& visitor) {
    visit_each(visitor, "delayed", delayed, "superseded", superseded, "dropped", dropped);
  }
};

/// Processor time and memory of the process.
struct ProcessSummary {
  double cpu_s = 0.0;     ///< User and system time.
  double system_s = 0.0;  ///< Time in the kernel.
  std::uint64_t page_faults = 0;
  std::uint64_t peak_memory_bytes = 0;
  std::uint64_t memory_at_start_bytes = 0;
  std::uint64_t memory_at_end_bytes = 0;
  /// Slope of the line of least squares through the second half of the time. Absent if that half is
  /// shorter than a minute, because allocations at the start are no growth.
  std::optional<double> memory_growth_bytes_per_minute;

  void visit_fields(auto& visitor) {
    visit_each(visitor, "cpu_s", cpu_s, "system_s", system_s, "page_faults", page_faults,
               "peak_memory_bytes", peak_memory_bytes, "memory_at_start_bytes",
               memory_at_start_bytes, "memory_at_end_bytes", memory_at_end_bytes,
               "memory_growth_bytes_per_minute", memory_growth_bytes_per_minute);
  }
};

/// Offset of both cameras to the inertial sensor relative to the rig, with standard deviations. The
/// standard deviations of rotation and translation are the largest over all directions.
struct CamerasSummary {
  double offset_s = 0.0,
         offset_sigma_s = 0.0;  ///< Added to stamps of images, gives those of the sensor.
  /// T_body_cam is this transform times the one of the rig; a rotation vector, about the axes of
  /// the body.
  double rotation_x_rad = 0.0, rotation_y_rad = 0.0, rotation_z_rad = 0.0;
  double rotation_sigma_rad = 0.0;
  double translation_x_m = 0.0, translation_y_m = 0.0, translation_z_m = 0.0;
  double translation_sigma_m = 0.0;
  /// Readout time of rolling shutters beyond tracker.readout_s.
  double readout_s = 0.0, readout_sigma_s = 0.0;

  void visit_fields(auto& visitor) {
    visit_each(visitor, "offset_s", offset_s, "offset_sigma_s", offset_sigma_s, "rotation_x_rad",
               rotation_x_rad, "rotation_y_rad", rotation_y_rad, "rotation_z_rad", rotation_z_rad,
               "rotation_sigma_rad", rotation_sigma_rad, "translation_x_m", translation_x_m,
               "translation_y_m", translation_y_m, "translation_z_m", translation_z_m,
               "translation_sigma_m", translation_sigma_m, "readout_s", readout_s,
               "readout_sigma_s", readout_sigma_s);
  }
};

/// Events of the odometry by cameras and, if there is one, inertial sensor. More than one start:
/// odometry restarted during the run.
void visit_fields(VioStatistics& met, auto& visitor) {
  visit_each(visitor, "inertial_sensor", met.has_imu, "starts", met.starts, "divergences",
             met.divergences, "inertial_gaps", met.gaps, "refused_images", met.refused_images,
             "refused_samples", met.refused_samples, "images_without_pose", met.images_without_pose,
             "vision_losses", met.vision_losses, "blind_seconds", met.blind_s);
}

/// Result of --localize.
struct LocalizationSummary {
  std::string map;                ///< Folder of the finished run.
  bool localised = false;         ///< Closures at two places or more tie this run to the map.
  std::optional<double> after_s;  ///< Time in the input until then; absent if it never was.
  std::uint64_t compared = 0;     ///< Number of keyframes that were compared with the map.
  std::uint64_t matched = 0;      ///< Number of these that match a keyframe of the map.

  void visit_fields(auto& visitor) {
    visit_each(visitor, "map", map, "localised", localised, "after_s", after_s, "compared",
               compared, "matched", matched);
  }
};

/// Result of absolute_fixes.
struct FixesSummary {
  bool located = false;           ///< The poses are in the absolute frame.
  std::optional<double> after_s;  ///< Time in the input until then; absent if they never were.
  std::uint64_t used = 0;      ///< Keyframes with a fix that agrees with odometry and other fixes.
  std::uint64_t rejected = 0;  ///< Keyframes with a fix that contradicts them.
  double residual_m = 0.0;     ///< Root mean square distance of used fixes from the trajectory.
  double rotation_sigma_rad = 0.0;  ///< Rotation of the trajectory to the absolute frame.
  /// Fixes from the input, and those that were not used by reason: see FixCounts.
  std::uint64_t received = 0;
  std::map<std::string, std::uint64_t> not_used;
  std::vector<double> datum;  ///< Latitude, longitude [deg], altitude [m]; empty: motion capture.
  /// Pose of the odometry frame in the absolute one at the last keyframe: x, y, z [m], heading
  /// [rad].
  std::vector<double> odometry_frame;

  void visit_fields(auto& visitor) {
    visit_each(visitor, "located", located, "after_s", after_s, "used", used, "rejected", rejected,
               "residual_m", residual_m, "rotation_sigma_rad", rotation_sigma_rad, "received",
               received, "not_used", not_used, "datum", datum, "odometry_frame", odometry_frame);
  }
};

/// Times without a pose: see pose_holes().
struct HolesSummary {
  std::uint64_t count = 0;
  double seconds = 0.0;  ///< Total time.
  double longest_s = 0.0;
  double longest_from_s = 0.0;  ///< Begin of the longest hole, since the first pose.

  void visit_fields(auto& visitor) {
    visit_each(visitor, "count", count, "seconds", seconds, "longest_s", longest_s,
               "longest_from_s", longest_from_s);
  }
};

/// Difference of the optimised keyframes to odometry, both in the frame of the first keyframe.
struct CorrectionSummary {
  double largest_m = 0.0;
  /// Median over the keyframes of the squared difference, normalised by the covariance of odometry:
  /// less than about 1 if odometry and the optimised keyframes are right.
  double normalised_square = 0.0;

  void visit_fields(auto& visitor) {
    visit_each(visitor, "largest_m", largest_m, "normalised_square", normalised_square);
  }
};

/// A time without a pose between two poses of a trajectory.
struct PoseHole {
  Stamp from = 0, to = 0;
};

/// Holes longer than kHole_s and than kHoleIntervals times the median interval, in the order of
/// time: times in which the motion of the robot is unknown. `path` ascends by time. O(n).
[[nodiscard]] std::vector<PoseHole> pose_holes(std::span<const StampedPose> path);

/// The page of the viewer (Robot in model.js) uses the same values.
inline constexpr double kHole_s = 1.0;
inline constexpr double kHoleIntervals = 5.0;

/// Shorter pauses of a recording are not reported: an ordinary computer has them, too.
inline constexpr double kNoticedPause_s = 1.0;

/// Totals of a robot's run: summary.json, and the robot's part of a team's --json. The names in
/// visit_fields are the keys, which are written and read in this order. An absent optional has no
/// key; NaN is written as null.
struct RunSummary {
  RobotId robot = 0;
  std::string name;
  std::string version,
      commit;  ///< Version and commit of the program: see built_version() and built_commit().
  std::uint64_t keyframes = 0;
  std::uint64_t keypoints = 0;       ///< Number in all keyframes.
  std::uint64_t frames = 0;          ///< Stereo pairs played.
  std::uint64_t frames_skipped = 0;  ///< Pairs left out because processors were short.
  double paused_s = 0.0;  ///< Time for which the recording's clock paused for the same reason.
  /// By kind, the number of faults of the recording or the live topics: see ReaderFault.
  std::map<std::string, std::uint64_t> sensor_faults;
  PeerKeyframeCounts peer_keyframes;
  ClosureCounts closures;  ///< Closures found by this robot.
  OptimizerProgress pgo;
  std::optional<VioStatistics> odometry;            ///< Absent with an external odometry.
  std::optional<LocalizationSummary> localization;  ///< Absent without --localize.
  std::optional<FixesSummary> fixes;                ///< Absent without absolute fixes.
  std::optional<HolesSummary> holes;  ///< Holes of the live trajectory; absent without any.
  std::optional<CorrectionSummary> correction;   ///< Absent before the first solution.
  std::optional<CamerasSummary> cameras;         ///< Absent without vio.calibrate.
  std::optional<MappingSummary> mapping;         ///< Absent if mapping is off.
  std::map<std::string, std::uint64_t> traffic;  ///< Bytes sent, by category.
  std::optional<HeldBackSums> held_back;         ///< Absent without a budget.
  ProcessSummary process;
  double seconds = 0.0;  ///< Wall time of the run.
  /// By name, robots that went silent and did not return, with the time of their silence [s].
  std::map<std::string, double> lost_peers;
  /// By name, robots that were received but not in one frame with this one, with the time of that
  /// state [s].
  std::map<std::string, double> apart_peers;
  /// By name, robots that were announced or received, but never met, with the reason.
  std::map<std::string, std::string> unmet_peers;
  std::uint64_t forged_announcements = 0;  ///< Robots with contradicting announcements.
  /// By name, robots with another vocabulary, with the number of keyframes that could not be
  /// compared.
  std::map<std::string, std::uint64_t> other_vocabulary;
  /// By name, robots that describe keypoints by another network, with the number of keyframes that
  /// were compared by ORB for this reason.
  std::map<std::string, std::uint64_t> other_network;
  std::vector<Finding> noticed;  ///< Findings on sensors and network, without the robot's name.
  std::string exit_reason;
  std::vector<Finding> findings;  ///< Findings, the gravest first: see findings_of().

  void visit_fields(auto& visitor) {
    visit_each(visitor, "robot", robot, "name", name, "version", version, "commit", commit,
               "keyframes", keyframes, "keypoints", keypoints, "frames", frames, "frames_skipped",
               frames_skipped, "paused_s", paused_s, "sensor_faults", sensor_faults,
               "peer_keyframes", peer_keyframes, "closures", closures, "pgo", pgo, "odometry",
               odometry, "localization", localization, "absolute_fixes", fixes, "holes", holes,
               "correction", correction, "cameras", cameras, "mapping", mapping, "traffic", traffic,
               "held_back", held_back, "process", process, "seconds", seconds, "lost_peers",
               lost_peers, "apart_peers", apart_peers, "unmet_peers", unmet_peers,
               "forged_announcements", forged_announcements, "other_vocabulary", other_vocabulary,
               "other_network", other_network, "noticed", noticed, "exit_reason", exit_reason,
               "findings", findings);
  }
};

void to_json(Json& json, const RunSummary& summary);

/// Throws std::runtime_error naming the file.
void write_summary(const std::filesystem::path& file, const RunSummary& summary);

/// Keys that are absent keep their default, others are ignored. Throws std::runtime_error naming
/// the file, and the key, if it is missing, no JSON object, or has a value of another type.
[[nodiscard]] RunSummary read_summary(const std::filesystem::path& file);

}  // namespace km
