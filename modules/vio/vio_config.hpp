#pragma once

#include "modules/core/config.hpp"

namespace km {

/// Parameters of Vio without its feature tracker. Field names are the YAML keys below `vio:`.
struct VioConfig {
  static constexpr const char* kSection = "vio";

  /// Keyframes that the smoother keeps. More: smoother and slower.
  int window_keyframes = 7;

  /// Most recent images kept besides keyframes. Fewer: faster.
  int window_recent = 3;

  /// Steps of the optimisation for every image.
  int iterations = 3;

  /// Standard deviation of a tracked image point [px].
  double noise_px = 0.7;

  /// Scale of the Cauchy loss on reprojection errors, in standard deviations.
  double loss_scale = 1.5;

  /// Observations farther than this from their landmark are dropped [px].
  double outlier_px = 3.0;

  /// The sensor's noise densities are multiplied by these: vibration, imperfect time stamps and
  /// calibration add to the noise of the data sheet.
  double gyro_noise_factor = 8.0;
  double accel_noise_factor = 12.0;

  /// Gravity where the robots are [m/s^2].
  double gravity_mps2 = 9.81;

  /// Standard deviation of an accelerometer's bias before anything is known of it [m/s^2].
  double accel_bias_sigma = 0.05;

  /// A new keyframe of the smoother: when the image has moved by this much, rotation taken out
  /// [px],
  double keyframe_parallax_px = 12.0;
  /// or when this share of the last keyframe's features, or less, is still tracked,
  double keyframe_tracked_share = 0.6;
  /// or after this long [s].
  double keyframe_interval_s = 1.0;

  /// Images held back to start from [s]; all their poses come when it is over.
  double start_s = 0.75;

  /// Still unable to start after this long, odometry starts again with newer images [s].
  double start_timeout_s = 3.0;

  /// A start at rest needs less image motion than this over the images held back [px],
  double rest_parallax_px = 1.0;
  /// and less change of the mean accelerometer [m/s^2] and gyroscope [rad/s] from their first half
  /// to the second than this.
  double rest_accel_mps2 = 0.5;
  double rest_gyro_radps = 0.05;

  /// A keyframe is handed on at least this long after the one before [s], and then
  double output_interval_s = 0.3;
  /// when the body has moved by this much [m]
  double output_distance_m = 0.1;
  /// or turned by this much [rad]
  double output_rotation_rad = 0.1;
  /// or, even at rest, after this long [s].
  double output_rest_interval_s = 2.0;

  /// Error of the relative pose of two keyframes that the smoother cannot know of (calibration,
  /// drifting tracks, synchronisation), a random walk added to its covariance, each axis
  /// [rad/sqrt(s)], [m/sqrt(s)].
  double drift_rotation = 7e-4;
  double drift_translation = 4e-3;

  /// Error of the verticals that are handed on with keyframes, each horizontal axis [rad]; below
  /// 1e-4: none are. It comes from biases that hardly change: over so many keyframes in a row it is
  /// one error, and all their verticals together know no more than one. What uses them takes errors
  /// for independent, so each is handed on with sqrt(tilt_keyframes) times this sigma.
  double tilt_sigma = 1e-2;
  int tilt_keyframes = 120;

  /// Longest time between two inertial samples that is interpolated [s]; longer: a new start.
  double max_imu_gap_s = 0.1;

  /// A faster body means that the estimate has diverged [m/s]; so do larger biases.
  double max_speed_mps = 30.0;
  double max_gyro_bias_radps = 0.5;
  double max_accel_bias_mps2 = 3.0;

  void visit_fields(auto& visitor) {
    visitor.field("window_keyframes", window_keyframes, {3, 50}, "of the smoother");
    visitor.field("window_recent", window_recent, {1, 20}, "images beside the keyframes");
    visitor.field("iterations", iterations, {1, 50}, "for every image");
    visitor.field("noise_px", noise_px, {0.01, 20.0}, "[px]");
    visitor.field("loss_scale", loss_scale, {0.1, 1e3}, "[standard deviations]");
    visitor.field("outlier_px", outlier_px, {0.1, 100.0}, "[px]");
    visitor.field("gyro_noise_factor", gyro_noise_factor, {0.1, 1e3}, "on the data sheet");
    visitor.field("accel_noise_factor", accel_noise_factor, {0.1, 1e3}, "on the data sheet");
    visitor.field("gravity_mps2", gravity_mps2, {9.7, 9.9}, "[m/s^2]");
    visitor.field("accel_bias_sigma", accel_bias_sigma, {1e-4, 5.0}, "[m/s^2]");
    visitor.field("keyframe_parallax_px", keyframe_parallax_px, {0.5, 200.0}, "[px]");
    visitor.field("keyframe_tracked_share", keyframe_tracked_share, {0.0, 1.0},
                  "of the last keyframe");
    visitor.field("keyframe_interval_s", keyframe_interval_s, {0.05, 5.0}, "[s]");
    visitor.field("start_s", start_s, {0.2, 5.0}, "[s] of images held back");
    visitor.field("start_timeout_s", start_timeout_s, {0.5, 60.0}, "[s]");
    visitor.field("rest_parallax_px", rest_parallax_px, {0.0, 20.0}, "[px]");
    visitor.field("rest_accel_mps2", rest_accel_mps2, {0.0, 10.0}, "[m/s^2]");
    visitor.field("rest_gyro_radps", rest_gyro_radps, {0.0, 1.0}, "[rad/s]");
    visitor.field("output_interval_s", output_interval_s, {0.0, 10.0}, "[s] at least");
    visitor.field("output_distance_m", output_distance_m, {0.0, 10.0}, "[m]");
    visitor.field("output_rotation_rad", output_rotation_rad, {0.0, 3.2}, "[rad]");
    visitor.field("output_rest_interval_s", output_rest_interval_s, {0.1, 1e3}, "[s] at most");
    visitor.field("drift_rotation", drift_rotation, {0.0, 0.1}, "[rad/sqrt(s)]");
    visitor.field("drift_translation", drift_translation, {0.0, 1.0}, "[m/sqrt(s)]");
    visitor.field("tilt_sigma", tilt_sigma, {0.0, 1.5},
                  "[rad] of the verticals; below 1e-4: the pose graph does without");
    visitor.field("tilt_keyframes", tilt_keyframes, {1, 100000},
                  "in a row have one error of the vertical in common");
    visitor.field("max_imu_gap_s", max_imu_gap_s, {1e-3, 1.0}, "[s]");
    visitor.field("max_speed_mps", max_speed_mps, {0.1, 1e3}, "[m/s]");
    visitor.field("max_gyro_bias_radps", max_gyro_bias_radps, {1e-3, 10.0}, "[rad/s]");
    visitor.field("max_accel_bias_mps2", max_accel_bias_mps2, {1e-2, 50.0}, "[m/s^2]");
  }
};

}  // namespace km
