#pragma once

#include <optional>
#include <span>
#include <vector>

#include "modules/core/stamped_pose.hpp"

namespace km {

/// The same instant in the truth and in an estimate; each pose in its own world.
struct PosePair {
  Stamp stamp = 0;
  SE3 T_truth_body = SE3::Identity();
  SE3 T_estimate_body = SE3::Identity();
};

/// A span of time, both ends included.
struct TimeWindow {
  Stamp from = 0;
  Stamp to = 0;
};

/// Pose at `stamp`: interpolated (translation linearly, rotation along the geodesic) between the
/// poses around it if they are at most `max_gap_s` apart, else the nearest one if it is at most
/// `max_difference_s` away, else nullopt. `poses` ascending. O(log n).
[[nodiscard]] std::optional<SE3> pose_at(std::span<const StampedPose> poses, Stamp stamp,
                                         double max_gap_s, double max_difference_s);

/// Pairs the two trajectories at the stamps of the one with fewer poses in the time they share,
/// interpolating the other as pose_at() does. Only stamps inside `window` count.
[[nodiscard]] std::vector<PosePair> associate(std::span<const StampedPose> truth,
                                              std::span<const StampedPose> estimate,
                                              const TimeWindow& window, double max_gap_s,
                                              double max_difference_s);

/// Time in `window` that `poses` cover [s]: that between neighbours at most `max_gap_s` apart.
[[nodiscard]] double covered_seconds(std::span<const StampedPose> poses, const TimeWindow& window,
                                     double max_gap_s);

}  // namespace km
