#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "modules/core/config.hpp"

namespace km {

/// Sizes of the errors of an inertial sensor that its calibration does not state. Signs and phases
/// are random; 0 switches an error off.
struct InertialErrorConfig {
  static constexpr const char* kSection = "inertial";

  double gyro_scale = 0.0;
  double accel_scale = 0.0;
  double misalignment_rad = 0.0;
  double vibration_gyro_rps = 0.0;
  double vibration_accel_mps2 = 0.0;
  double vibration_hz = 37.0;
  double warm_gyro_rps = 0.0;
  double warm_accel_mps2 = 0.0;
  double warm_up_s = 60.0;

  void visit_fields(auto& visitor) {
    visitor.field("gyro_scale", gyro_scale, {0.0, 0.2}, "share of the rate, on each axis");
    visitor.field("accel_scale", accel_scale, {0.0, 0.2}, "share of the specific force");
    visitor.field("misalignment_rad", misalignment_rad, {0.0, 0.2},
                  "rad, tilt of each axis towards each other axis");
    visitor.field("vibration_gyro_rps", vibration_gyro_rps, {0.0, 10.0},
                  "rad/s, amplitude of the sensor's vibration on its mount");
    visitor.field("vibration_accel_mps2", vibration_accel_mps2, {0.0, 100.0}, "m/s^2, amplitude");
    visitor.field("vibration_hz", vibration_hz, {0.1, 2000.0},
                  "Hz; above half the sampling rate it appears as a slower vibration");
    visitor.field("warm_gyro_rps", warm_gyro_rps, {0.0, 1.0},
                  "rad/s, change of the bias until the sensor is warm");
    visitor.field("warm_accel_mps2", warm_accel_mps2, {0.0, 10.0}, "m/s^2, change of the bias");
    visitor.field("warm_up_s", warm_up_s, {0.1, 36000.0},
                  "s, time constant of the temperature after the start");
  }
};

/// The errors of one sensor. A measured value is matrix * true value + bias + noise + vibration.
struct InertialErrors {
  Eigen::Matrix3d gyro_matrix = Eigen::Matrix3d::Identity();   ///< Scale and misalignment.
  Eigen::Matrix3d accel_matrix = Eigen::Matrix3d::Identity();  ///< Scale and misalignment.
  Eigen::Vector3d gyro_vibration = Eigen::Vector3d::Zero();    ///< Amplitude [rad/s].
  Eigen::Vector3d accel_vibration = Eigen::Vector3d::Zero();   ///< Amplitude [m/s^2].
  Eigen::Vector3d phase = Eigen::Vector3d::Zero();             ///< Phase of both vibrations [rad].
  double vibration_hz = 37.0;
  Eigen::Vector3d gyro_warm = Eigen::Vector3d::Zero();   ///< Bias of the warm sensor [rad/s].
  Eigen::Vector3d accel_warm = Eigen::Vector3d::Zero();  ///< Bias of the warm sensor [m/s^2].
  double warm_up_s = 60.0;

  /// Share of the way to the warm sensor's temperature, `t_s` after the start: 1 - exp(-t / tau).
  [[nodiscard]] double warmth(double t_s) const;
  /// Sine of the vibration on each axis at `t_s`.
  [[nodiscard]] Eigen::Vector3d sway(double t_s) const;
};

/// Errors of the configured sizes, with random signs and phases. Throws ConfigError.
[[nodiscard]] InertialErrors draw_inertial_errors(const InertialErrorConfig& config,
                                                  std::uint64_t seed);

}  // namespace km
