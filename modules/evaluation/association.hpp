#pragma once

#include <optional>
#include <span>
#include <vector>

#include "modules/core/data/stamped_pose.hpp"

namespace km {

/// Poses of the truth and of an estimate at the same instant, each in its own world.
struct PosePair {
  Stamp stamp = 0;
  SE3 T_truth_body = SE3::Identity();
  SE3 T_estimate_body = SE3::Identity();
};

/// An interval of time, both ends included.
struct TimeWindow {
  Stamp from = 0;
  Stamp to = 0;
};

/// Limits of pose_at() for true poses: the longest gap that is interpolated, and the largest
/// difference to the nearest pose.
inline constexpr double kMaxGap_s = 0.1, kMaxDifference_s = 0.01;

/// Pose at `stamp`. If the poses around it are at most `max_gap_s` apart, it is interpolated
/// (translation linearly, rotation along the geodesic). Otherwise the nearest pose if it is at most
/// `max_difference_s` away, else nullopt. `poses` ascending. O(log n).
[[nodiscard]] std::optional<SE3> pose_at(std::span<const StampedPose> poses, Stamp stamp,
                                         double max_gap_s = kMaxGap_s,
                                         double max_difference_s = kMaxDifference_s);

/// Pairs the two trajectories in the time they share, at the stamps of the one with fewer poses
/// there. The other one is interpolated as in pose_at(). Only stamps inside `window` count.
[[nodiscard]] std::vector<PosePair> associate(std::span<const StampedPose> truth,
                                              std::span<const StampedPose> estimate,
                                              const TimeWindow& window);

/// Time in `window` that `poses` cover [s]: intervals between neighbours at most `max_gap_s` apart.
[[nodiscard]] double covered_seconds(std::span<const StampedPose> poses, const TimeWindow& window,
                                     double max_gap_s);

}  // namespace km
