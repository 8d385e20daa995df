#pragma once

#include "modules/core/config.hpp"

namespace km {

/// Parameters of Vio without its feature tracker.
struct VioConfig {
  static constexpr const char* kSection = "vio";

  int window_keyframes = 7;
  int window_recent = 3;
  int iterations = 3;
  double noise_px = 0.7;
  double loss_scale = 1.5;
  double outlier_px = 3.0;
  double gyro_noise_factor = 8.0;
  double accel_noise_factor = 12.0;
  double gravity_mps2 = 9.81;
  double accel_bias_sigma = 0.05;
  double keyframe_parallax_px = 12.0;
  double keyframe_tracked_share = 0.6;
  double keyframe_interval_s = 1.0;
  bool calibrate = true;
  double calibration_offset_s = 0.01;
  double calibration_rotation_rad = 0.01;
  double calibration_translation_m = 0.003;
  double start_s = 0.75;
  double start_timeout_s = 3.0;
  double rest_parallax_px = 1.0;
  double rest_accel_mps2 = 0.5;
  double rest_gyro_radps = 0.05;
  double rest_s = 1.0;
  double output_interval_s = 0.3;
  double output_distance_m = 0.1;
  double output_rotation_rad = 0.1;
  double output_rest_interval_s = 2.0;
  double drift_rotation = 7e-4;
  double drift_translation = 4e-3;
  double tilt_sigma = 1e-2;
  int tilt_keyframes = 120;
  double max_imu_gap_s = 0.1;
  double max_speed_mps = 30.0;
  double max_gyro_bias_radps = 0.5;
  double max_accel_bias_mps2 = 3.0;

  void visit_fields(auto& visitor) {
    visitor.field("window_keyframes", window_keyframes, {3, 50},
                  "that the smoother keeps; more: smoother and slower");
    visitor.field("window_recent", window_recent, {1, 20},
                  "most recent images kept besides; fewer: faster");
    visitor.field("iterations", iterations, {1, 50}, "steps of the optimisation for every image");
    visitor.field("noise_px", noise_px, {0.01, 20.0},
                  "[px] standard deviation of a tracked image point");
    visitor.field("loss_scale", loss_scale, {0.1, 1e3},
                  "[standard deviations] of the Cauchy loss on reprojection errors");
    visitor.field("outlier_px", outlier_px, {0.1, 100.0},
                  "[px] observations farther from their landmark are dropped");
    visitor.field("gyro_noise_factor", gyro_noise_factor, {0.1, 1e3},
                  "on the sensor's noise density: vibration, imperfect time stamps and calibration "
                  "add to it; where images contradict it, up to four times as much");
    visitor.field("accel_noise_factor", accel_noise_factor, {0.1, 1e3}, "the same");
    visitor.field("gravity_mps2", gravity_mps2, {9.7, 9.9}, "[m/s^2] where the robots are");
    visitor.field("accel_bias_sigma", accel_bias_sigma, {1e-4, 5.0},
                  "[m/s^2] standard deviation before anything is known of the bias");
    visitor.field("keyframe_parallax_px", keyframe_parallax_px, {0.5, 200.0},
                  "[px] a new keyframe of the smoother: when the image has moved by this much, "
                  "rotation taken out");
    visitor.field("keyframe_tracked_share", keyframe_tracked_share, {0.0, 1.0},
                  "or this share of the last one's features, or less, is still tracked");
    visitor.field("keyframe_interval_s", keyframe_interval_s, {0.05, 5.0},
                  "[s] or after this long");
    visitor.field("calibrate", calibrate,
                  "estimates how the cameras' stamps and mounting differ from what the rig says, "
                  "both cameras in common");
    visitor.field("calibration_offset_s", calibration_offset_s, {1e-9, 1.0},
                  "[s] standard deviation of the stamps before anything is known of them; small: "
                  "they are right");
    visitor.field("calibration_rotation_rad", calibration_rotation_rad, {1e-9, 1.0},
                  "[rad] of the mounting, each axis");
    visitor.field("calibration_translation_m", calibration_translation_m, {1e-9, 1.0},
                  "[m] likewise");
    visitor.field("start_s", start_s, {0.2, 5.0},
                  "[s] of images held back to start from; all their poses come when it is over");
    visitor.field("start_timeout_s", start_timeout_s, {0.5, 60.0},
                  "[s] still unable to start, odometry starts again with newer images");
    visitor.field("rest_parallax_px", rest_parallax_px, {0.0, 20.0},
                  "[px] of image motion over the images held back: a start at rest needs less, and "
                  "later a rest over rest_s");
    visitor.field("rest_accel_mps2", rest_accel_mps2, {0.0, 10.0},
                  "[m/s^2] and less change of the mean accelerometer from their first half to the "
                  "second, later from what the estimate explains");
    visitor.field("rest_gyro_radps", rest_gyro_radps, {0.0, 1.0},
                  "[rad/s] and of the mean gyroscope");
    visitor.field("rest_s", rest_s, {0.1, 1e6},
                  "[s] a body that has stood still for this long is at rest: no keyframes come "
                  "of it until it moves");
    visitor.field("output_interval_s", output_interval_s, {0.0, 10.0},
                  "[s] a keyframe is handed on at least this long after the one before, and then");
    visitor.field("output_distance_m", output_distance_m, {0.0, 10.0},
                  "[m] when the body has moved by this much");
    visitor.field("output_rotation_rad", output_rotation_rad, {0.0, 3.2},
                  "[rad] or turned by this much");
    visitor.field("output_rest_interval_s", output_rest_interval_s, {0.1, 1e3},
                  "[s] or, even if it hardly moves, after this long; rests do not count");
    visitor.field(
        "drift_rotation", drift_rotation, {0.0, 0.1},
        "[rad/sqrt(s)] random walk per axis added to the covariance between keyframes: "
        "calibration, drifting tracks, synchronisation, of which the smoother cannot know");
    visitor.field("drift_translation", drift_translation, {0.0, 1.0}, "[m/sqrt(s)] the same");
    visitor.field("tilt_sigma", tilt_sigma, {0.0, 1.5},
                  "[rad] of the verticals handed on with keyframes, each horizontal axis; below "
                  "1e-4: none are");
    visitor.field(
        "tilt_keyframes", tilt_keyframes, {1, 100000},
        "in a row have one error of the vertical in common, from biases that hardly change; who "
        "uses them takes errors for independent: each gets sqrt(tilt_keyframes) times tilt_sigma, "
        "and beyond 1.5 rad none are handed on");
    visitor.field(
        "max_imu_gap_s", max_imu_gap_s, {1e-3, 1.0},
        "[s] longest between two inertial samples that is interpolated; longer: images alone tell "
        "the motion, or, where they do not, a new start");
    visitor.field("max_speed_mps", max_speed_mps, {0.1, 1e3},
                  "[m/s] a faster body means that the estimate has diverged");
    visitor.field("max_gyro_bias_radps", max_gyro_bias_radps, {1e-3, 10.0},
                  "[rad/s] so do larger biases");
    visitor.field("max_accel_bias_mps2", max_accel_bias_mps2, {1e-2, 50.0}, "[m/s^2] likewise");
  }
};

}  // namespace km
