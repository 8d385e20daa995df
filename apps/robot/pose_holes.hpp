#pragma once

#include <span>
#include <vector>

#include "modules/core/stamped_pose.hpp"

namespace km {

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

}  // namespace km
