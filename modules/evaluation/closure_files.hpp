#pragma once

#include <filesystem>
#include <span>
#include <stdexcept>
#include <vector>

#include "modules/core/stamped_pose.hpp"
#include "modules/evaluation/closure_truth.hpp"

namespace km {

/// A robot's file about its closures that cannot be used. what() is one line that names file and
/// line.
struct ClosureFileError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// A keyframe as its robot recorded it.
struct KeyframeRecord {
  KeyframeId id;
  Stamp stamp = 0;
  double scene_depth_m = 0.0;  ///< Median depth of its keypoints; 0: unknown.
};

/// Reads a robot's keyframes.csv: `robot, keyframe, stamp [ns], median depth [m]` below a header.
/// Throws ClosureFileError.
[[nodiscard]] std::vector<KeyframeRecord> read_keyframes(const std::filesystem::path& file);

/// Reads a robot's loop_closures.csv: `from_robot, from_keyframe, to_robot, to_keyframe,
/// similarity, stage, matches, inliers, tx, ty, tz, qx, qy, qz, qw, ...` below a header; the pose
/// [m] is empty where there is none. Throws ClosureFileError, also for a closure that is verified
/// but has none.
[[nodiscard]] std::vector<ClosureRecord> read_closures(const std::filesystem::path& file);

/// The keyframes whose stamps lie within the true poses `truth` (ascending), with their pose there.
[[nodiscard]] std::vector<TrueKeyframe> place_keyframes(std::span<const KeyframeRecord> keyframes,
                                                        std::span<const StampedPose> truth);

}  // namespace km
