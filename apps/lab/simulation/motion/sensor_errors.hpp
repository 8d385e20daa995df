#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "modules/core/camera/camera.hpp"
#include "modules/core/config.hpp"
#include "modules/core/stamp.hpp"

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
  }
};

/// The errors of one sensor. A measured value is matrix * true value + bias + noise + vibration.
struct InertialErrors {
  Eigen::Matrix3d gyro_matrix = Eigen::Matrix3d::Identity();   ///< Scale and misalignment.
  Eigen::Matrix3d accel_matrix = Eigen::Matrix3d::Identity();  ///< Scale and misalignment.
  double gyro_vibration = 0.0;                                 ///< Amplitude [rad/s].
  double accel_vibration = 0.0;                                ///< Amplitude [m/s^2].
  Eigen::Vector3d phase = Eigen::Vector3d::Zero();             ///< Phase of both vibrations [rad].
  double vibration_hz = 37.0;
  Eigen::Vector3d gyro_warm = Eigen::Vector3d::Zero();   ///< Bias of the warm sensor [rad/s].
  Eigen::Vector3d accel_warm = Eigen::Vector3d::Zero();  ///< Bias of the warm sensor [m/s^2].

  /// Share of the way to the warm sensor's temperature, `t_s` after the start: 1 - exp(-t / tau).
  [[nodiscard]] double warmth(double t_s) const;
  /// Sine of the vibration on each axis at `t_s`.
  [[nodiscard]] Eigen::Vector3d sway(double t_s) const;
};

/// Errors of the configured sizes, with random signs and phases. Throws ConfigError.
[[nodiscard]] InertialErrors draw_inertial_errors(const InertialErrorConfig& config,
                                                  std::uint64_t seed);

/// Errors of stamps and lost images. Signs of drifts are random; 0 switches an error off.
struct TimingErrorConfig {
  static constexpr const char* kSection = "timing";

  double drift_ppm = 0.0;
  double jump_s = 0.0;
  double jump_every_s = 0.0;
  double camera_drift_ppm = 0.0;
  double camera_delay_s = 0.0;
  double dropped_share = 0.0;
  double dropped_run = 1.0;

  void visit_fields(auto& visitor) {
    visitor.field("drift_ppm", drift_ppm, {0.0, 10000.0},
                  "parts per million by which the robot's clock is fast or slow");
    visitor.field("jump_s", jump_s, {0.0, 10.0}, "s, by which the robot's clock jumps ahead");
    visitor.field("jump_every_s", jump_every_s, {0.0, 36000.0},
                  "s, mean time between jumps; 0: none");
    visitor.field("camera_drift_ppm", camera_drift_ppm, {0.0, 10000.0},
                  "parts per million, the cameras' clock against the robot's");
    visitor.field("camera_delay_s", camera_delay_s, {0.0, 1.0},
                  "s, by which the stamps of images are late");
    visitor.field("dropped_share", dropped_share, {0.0, 0.9}, "share of images that are lost");
    visitor.field("dropped_run", dropped_run, {1.0, 1000.0},
                  "images, mean number that are lost in a row");
  }
};

/// The clocks of one robot: the stamps that they give to true times. Stamps ascend with time. True
/// time and all clocks agree at `start`, except for the delay of the cameras. Immutable.
class RobotClock {
 public:
  /// `end`: end of the recording; there are no jumps after it. Throws ConfigError.
  RobotClock(const TimingErrorConfig& config, Stamp start, Stamp end, std::uint64_t seed);

  /// Stamp of inertial samples and true states.
  [[nodiscard]] Stamp inertial(Stamp true_time) const;
  /// Stamp of images.
  [[nodiscard]] Stamp camera(Stamp true_time) const;

 private:
  Stamp start_ = 0;
  double drift_ = 0.0;
  double camera_drift_ = 0.0;
  Stamp jump_ = 0;
  Stamp delay_ = 0;
  std::vector<Stamp> jumps_;
};

/// `images` without those that are lost: a Markov chain with the configured share and mean run.
/// The first image is never lost. Throws ConfigError.
[[nodiscard]] std::vector<Stamp> without_dropped(const std::vector<Stamp>& images,
                                                 const TimingErrorConfig& config,
                                                 std::uint64_t seed);

/// Sizes of the differences between the cameras' true calibration and the one that the robot gets.
/// Signs and axes are random; 0: no difference.
struct CalibrationErrorConfig {
  static constexpr const char* kSection = "calibration_error";

  double focal_share = 0.0;
  double mounting_rad = 0.0;
  double stereo_rad = 0.0;

  void visit_fields(auto& visitor) {
    visitor.field("focal_share", focal_share, {0.0, 0.2},
                  "share of the focal lengths, the same for both cameras");
    visitor.field("mounting_rad", mounting_rad, {0.0, 0.5},
                  "rad, rotation of the cameras together against the inertial sensor");
    visitor.field("stereo_rad", stereo_rad, {0.0, 0.1},
                  "rad, rotation of the right camera against the left one");
  }
};

/// The calibration that a robot with the true rig `truth` gets. The pair of cameras rotates about
/// the middle between them. Throws ConfigError.
[[nodiscard]] SensorRig told_rig(const SensorRig& truth, const CalibrationErrorConfig& config,
                                 std::uint64_t seed);

}  // namespace km
