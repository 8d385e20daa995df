#pragma once

#include "modules/core/frame.hpp"

namespace km {

/// What no inertial sensor of a robot measures: gyroscopes end at 4000 degrees per second (70
/// rad/s), accelerometers at 16 to 40 times gravity. A sample beyond is not a violent motion but
/// broken, and an estimate that takes it in has lost its pose.
inline constexpr double kMaxAngularRate_radps = 100.0;
inline constexpr double kMaxSpecificForce_mps2 = 1000.0;

/// False for NaN, too.
[[nodiscard]] inline bool is_plausible(const ImuSample& sample) {
  return sample.gyro.norm() <= kMaxAngularRate_radps &&
         sample.accel.norm() <= kMaxSpecificForce_mps2;
}

}  // namespace km
