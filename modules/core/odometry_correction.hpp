#pragma once

#include <span>
#include <vector>

#include "modules/core/stamped_pose.hpp"

namespace km {

/// Body poses in `world` at every stamp of `odometry`, given optimised poses of some of those
/// instants: live odometry corrected by the last solution of the pose graph.
///
/// `odometry` holds T_odom_body, ascending stamps; `keyframes` T_world_kf, ascending stamps, each
/// at a stamp of `odometry` (others are passed over). The correction T_world_odom of each keyframe
/// is interpolated in time between two keyframes (rotation along the geodesic, the body's position
/// linearly) and held constant before the first and after the last. With no keyframe in common the
/// result is `odometry` itself. Linear in the lengths.
[[nodiscard]] std::vector<StampedPose> correct_odometry(std::span<const StampedPose> odometry,
                                                        std::span<const StampedPose> keyframes);

}  // namespace km
