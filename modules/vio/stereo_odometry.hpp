#pragma once

#include <optional>
#include <span>
#include <vector>

#include "modules/core/camera.hpp"
#include "modules/vio/fixed_lag_smoother.hpp"

namespace km {

/// Poses of consecutive images from stereo alone, T_first_body, or nullopt if an image shares too
/// few located landmarks with those before it. `R_previous_current` are rotations to start from,
/// one for each image after the first. Landmarks are triangulated where they are first seen with
/// depth, poses found one by one on them (Gauss-Newton on the reprojection errors): rough, for the
/// smoother to refine.
[[nodiscard]] std::optional<std::vector<SE3>> stereo_odometry(
    std::span<const InertialFrame> frames, std::span<const Eigen::Matrix3d> R_previous_current,
    const SensorRig& rig, const VioConfig& config);

}  // namespace km
