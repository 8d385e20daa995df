#pragma once

#include <span>
#include <vector>

#include "modules/core/data/stamped_pose.hpp"

namespace km {

/// Body poses in `world` at every stamp of `odometry`, from optimised poses of some of those
/// instants: live odometry corrected by the last solution of the pose graph.
///
/// `odometry` holds T_odom_body, ascending stamps; `keyframes` T_world_kf, ascending stamps.
/// Keyframes without a pose of `odometry` at their stamp are ignored. The correction T_world_odom
/// is interpolated in time between two keyframes (rotation along the geodesic, the body's position
/// linearly). It is constant before the first and after the last keyframe. Without a common
/// keyframe the result is `odometry` itself. Linear in the lengths.
[[nodiscard]] std::vector<StampedPose> correct_odometry(std::span<const StampedPose> odometry,
                                                        std::span<const StampedPose> keyframes);

}  // namespace km
