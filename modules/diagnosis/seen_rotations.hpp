#pragma once

#include <span>
#include <vector>

#include "modules/core/camera.hpp"
#include "modules/diagnosis/inertial_fit.hpp"
#include "modules/diagnosis/sensor_sample.hpp"

namespace km {

/// Rotations of the left camera, and of how many steps the right image told the depths. Without
/// depths a rotation and a translation across the image look much alike: the rotation that is found
/// depends on the focal length in either direction, and says nothing of it.
struct SeenRotations {
  std::vector<SeenRotation> steps;
  std::size_t with_depth = 0;
};

/// With the depths of `rig` where it is a stereo rig that the images fit, `use_depth` (see
/// estimate_motion() of the tracker); else by rotation_between(). Steps that do not tell are left
/// out. Deterministic.
[[nodiscard]] SeenRotations seen_rotations(std::span<const TrackedStep> steps, const StereoRig& rig,
                                           bool use_depth);

}  // namespace km
