#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "modules/core/frame.hpp"
#include "modules/core/stamped_pose.hpp"

namespace km {

/// Recorded poses with the motion in their gaps.
struct BridgedPoses {
  std::vector<StampedPose> poses;  ///< Those given and, in gaps, one at each inertial sample.
  std::size_t gaps = 0;            ///< Bridged.
  std::size_t open_gaps = 0;       ///< Left as they are: no inertial samples all the way.
  double longest_s = 0.0;          ///< Of the bridged ones.
  /// Distances between the inertial motion and the recorded poses on either side of the gaps.
  double rms_m = 0.0, max_m = 0.0;
};

/// Adds poses to gaps of more than 60 ms between `poses`, T_world_body with z up, ascending in
/// time, as published truths have where markers were lost: a curve drawn through such a gap
/// contradicts what the inertial sensor at the body's origin felt, and so would images along it.
/// Per gap, the samples from 0.25 s before it to 0.25 s after are integrated, and start, velocity
/// and constant biases are those that meet the recorded poses before and after in linear least
/// squares:
///   R(t) = Exp(d - int R^ b_g) R^(t),   p(t) = p0 + v0 t + iint (R (f - b_a) + g).
/// O(poses + samples).
[[nodiscard]] BridgedPoses bridge_gaps(std::span<const StampedPose> poses,
                                       std::span<const ImuSample> imu, double gravity_mps2 = 9.81);

}  // namespace km
