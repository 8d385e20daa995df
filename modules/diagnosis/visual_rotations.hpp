#pragma once

#include <span>
#include <vector>

#include "modules/core/camera.hpp"
#include "modules/diagnosis/inertial_fit.hpp"
#include "modules/diagnosis/sensor_sample.hpp"

namespace km {

/// Rotations of the left camera. Without depths a rotation and a translation across the image are
/// hard to distinguish. The estimated rotation then depends on the focal length, so it cannot serve
/// to estimate the focal length.
struct VisualRotations {
  std::vector<VisualRotation> steps;
  std::size_t with_depth = 0;  ///< Number of steps with depths from the right image.
};

/// For each step, rotation_between(), refined by estimate_motion() of the tracker if `use_depth`
/// and enough points have a depth. Undetermined steps are dropped. Deterministic.
[[nodiscard]] VisualRotations visual_rotations(std::span<const TrackedStep> steps,
                                               const StereoRig& rig, bool use_depth);

}  // namespace km
