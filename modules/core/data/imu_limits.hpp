#pragma once

#include "modules/core/camera/frame.hpp"

namespace km {

/// Bounds that no inertial sensor of a robot reaches. Gyroscopes measure up to 4000 degrees per
/// second (70 rad/s), accelerometers up to 16 to 40 times gravity. A sample beyond them is
/// invalid, and an estimate that used this sample would lose its pose.
inline constexpr double kMaxAngularRate_radps = 100.0;
inline constexpr double kMaxSpecificForce_mps2 = 1000.0;

/// True if the sample is within both limits. False for NaN.
[[nodiscard]] inline bool is_plausible(const ImuSample& sample) {
  return sample.gyro.norm() <= kMaxAngularRate_radps &&
         sample.accel.norm() <= kMaxSpecificForce_mps2;
}

}  // namespace km
