#pragma once

#include <cstddef>
#include <span>

#include "apps/lab/simulation/motion/spline_trajectory.hpp"
#include "modules/core/config.hpp"
#include "modules/core/stamped_pose.hpp"

namespace km {

/// Parameters of the fit to a recording.
struct RecordingOptions {
  static constexpr const char* kSection = "recording";

  double interval_s = 0.02;  ///< Interval of the spline's controls.
  /// Standard deviations of the poses; larger deviations lose weight as outliers.
  double position_noise_m = 0.0005;
  double rotation_noise_rad = 0.0005;
  /// Standard deviation of the derivative of the acceleration.
  double jerk_mps3 = 100.0;
  double rotation_jerk = 1000.0;  ///< [rad/s^3]

  void visit_fields(auto& visitor) {
    visitor.field("interval_s", interval_s, {1e-3, 1.0});
    visitor.field("position_noise_m", position_noise_m, {1e-6, 1.0});
    visitor.field("rotation_noise_rad", rotation_noise_rad, {1e-6, 1.0});
    visitor.field("jerk_mps3", jerk_mps3, {1e-3, 1e6});
    visitor.field("rotation_jerk", rotation_jerk, {1e-3, 1e6});
  }
};

/// Distances between the recorded poses and the curve.
struct FitDeviation {
  double position_rms_m = 0.0;
  double position_max_m = 0.0;
  double rotation_rms_rad = 0.0;
  double rotation_max_rad = 0.0;
};

struct RecordedTrajectory {
  SplineTrajectory trajectory;  ///< Time 0 is `epoch`.
  Stamp epoch = 0;
  FitDeviation deviation;
};

/// A smooth motion through recorded poses, by penalised and robust linear least squares. It passes
/// within the noise of them and bridges gaps. Time 0 of the trajectory is `epoch`, so that stamps
/// of images and inertial data convert by seconds_between(epoch, stamp). `poses` ascend strictly in
/// time; the curve covers the first to the last. Throws ConfigError for options out of range,
/// std::invalid_argument for fewer than two poses and stamps that do not ascend. O(poses +
/// controls).
[[nodiscard]] RecordedTrajectory fit_recording(std::span<const StampedPose> poses, Stamp epoch,
                                               const RecordingOptions& options = {});

}  // namespace km
