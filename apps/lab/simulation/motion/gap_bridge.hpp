#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "modules/core/frame.hpp"
#include "modules/core/stamped_pose.hpp"

namespace km {

/// Recorded poses with the motion in their gaps.
struct BridgedPoses {
  std::vector<StampedPose> poses;  ///< Recorded poses; in gaps, also one at each inertial sample.
  std::size_t gaps = 0;            ///< Number of bridged gaps.
  std::size_t open_gaps = 0;       ///< Number of other gaps, which lack inertial samples.
  double longest_s = 0.0;          ///< Longest bridged gap.
  /// Distances between the inertial motion and the recorded poses on either side of the gaps.
  double rms_m = 0.0, max_m = 0.0;
};

/// Adds poses to gaps of more than 60 ms between `poses`, T_world_body with z up, ascending in
/// time. Published truths have such gaps where markers were lost. A curve drawn through a gap
/// contradicts the measurements of the inertial sensor, as would images along it. For each gap, the
/// samples from 0.25 s before it to 0.25 s after it are integrated. Start, velocity and constant
/// biases fit the recorded poses before and after in linear least squares:
///   R(t) = Exp(d - int R^ b_g) R^(t),   p(t) = p0 + v0 t + iint (R (f - b_a) + g).
/// O(poses + samples).
[[nodiscard]] BridgedPoses bridge_gaps(std::span<const StampedPose> poses,
                                       std::span<const ImuSample> imu, double gravity_mps2 = 9.81);

}  // namespace km
