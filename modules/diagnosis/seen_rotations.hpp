#pragma once

#include <span>
#include <vector>

#include "modules/core/camera.hpp"
#include "modules/diagnosis/inertial_fit.hpp"
#include "modules/diagnosis/sensor_sample.hpp"

namespace km {

/// Rotations of the left camera, and the number of steps with depths from the right image. Without
/// depths a rotation and a translation across the image are hard to distinguish. The estimated
/// rotation then depends on the focal length, and cannot be used to estimate it.
struct SeenRotations {
  std::vector<SeenRotation> steps;
  std::size_t with_depth = 0;
};

/// Uses depths if `use_depth` and `rig` is a stereo rig that the images fit (see estimate_motion()
/// of the tracker), and else rotation_between(). Undetermined steps are dropped. Deterministic.
[[nodiscard]] SeenRotations seen_rotations(std::span<const TrackedStep> steps, const StereoRig& rig,
                                           bool use_depth);

}  // namespace km
