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
  double calibration_readout_s = 0.01;
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
  double motion_accel = 10.0;
  double motion_turn = 5.0;
  double max_speed_mps = 30.0;
  double max_gyro_bias_radps = 0.5;
  double max_accel_bias_mps2 = 3.0;

  void visit_fields(auto& visitor) {
    visitor.field(
        "window_keyframes", window_keyframes, {3, 50},
        "number of keyframes in the window of the smoother; more: more accurate and slower");
    visitor.field("window_recent", window_recent, {1, 20},
                  "number of most recent images in the window in addition; fewer: faster");
    visitor.field("iterations", iterations, {1, 50},
                  "largest number of optimisation steps per image");
    visitor.field("noise_px", noise_px, {0.01, 20.0},
                  "[px] standard deviation of a tracked image point");
    visitor.field("loss_scale", loss_scale, {0.1, 1e3},
                  "[standard deviations] scale of the Cauchy loss on reprojection errors");
    visitor.field("outlier_px", outlier_px, {0.1, 100.0},
                  "[px] observations farther from the projection of their landmark are dropped");
    visitor.field(
        "gyro_noise_factor", gyro_noise_factor, {0.1, 1e3},
        "factor on the noise density of the gyroscope, to cover vibration, time stamps "
        "and calibration; when images contradict the gyroscope, the factor rises up to four "
        "times this value");
    visitor.field("accel_noise_factor", accel_noise_factor, {0.1, 1e3},
                  "factor on the noise density of the accelerometer");
    visitor.field("gravity_mps2", gravity_mps2, {9.7, 9.9}, "[m/s^2] gravity at the site");
    visitor.field("accel_bias_sigma", accel_bias_sigma, {1e-4, 5.0},
                  "[m/s^2] standard deviation of the accelerometer bias at the start");
    visitor.field("keyframe_parallax_px", keyframe_parallax_px, {0.5, 200.0},
                  "[px] a keyframe of the smoother is made when the image has moved this far, "
                  "rotation removed");
    visitor.field(
        "keyframe_tracked_share", keyframe_tracked_share, {0.0, 1.0},
        "or when at most this share of the features of the last keyframe is still tracked");
    visitor.field("keyframe_interval_s", keyframe_interval_s, {0.05, 5.0},
                  "[s] or when this time has passed");
    visitor.field(
        "calibrate", calibrate,
        "estimates corrections to the stamps, to the mounting and to the readout time of the "
        "cameras, common to both cameras");
    visitor.field("calibration_offset_s", calibration_offset_s, {1e-9, 1.0},
                  "[s] standard deviation of the correction to the stamps at the start; small: no "
                  "correction");
    visitor.field(
        "calibration_rotation_rad", calibration_rotation_rad, {1e-9, 1.0},
        "[rad] standard deviation of the correction to the mounting at the start, each axis");
    visitor.field(
        "calibration_translation_m", calibration_translation_m, {1e-9, 1.0},
        "[m] standard deviation of the correction to the mounting at the start, each axis");
    visitor.field("calibration_readout_s", calibration_readout_s, {1e-9, 1.0},
                  "[s] standard deviation of the correction to tracker.readout_s at the start; "
                  "small: no correction");
    visitor.field(
        "start_s", start_s, {0.2, 5.0},
        "[s] duration of the images held back for a start; their poses are published after it");
    visitor.field(
        "start_timeout_s", start_timeout_s, {0.5, 60.0},
        "[s] after this time without a successful start, odometry drops the oldest images");
    visitor.field("rest_parallax_px", rest_parallax_px, {0.0, 20.0},
                  "[px] rest requires less image motion: at the start over the images held back, "
                  "later over rest_s");
    visitor.field("rest_accel_mps2", rest_accel_mps2, {0.0, 10.0},
                  "[m/s^2] rest requires a smaller change of the mean accelerometer: at the start "
                  "between the halves of the images held back, later against the estimate");
    visitor.field("rest_gyro_radps", rest_gyro_radps, {0.0, 1.0},
                  "[rad/s] rest requires a smaller change of the mean gyroscope, in the same way");
    visitor.field("rest_s", rest_s, {0.1, 1e6},
                  "[s] after this time without motion the body is at rest and makes no keyframes "
                  "until it moves");
    visitor.field("output_interval_s", output_interval_s, {0.0, 10.0},
                  "[s] smallest interval between published keyframes");
    visitor.field(
        "output_distance_m", output_distance_m, {0.0, 10.0},
        "[m] after that interval, a keyframe is published when the body has moved this far");
    visitor.field("output_rotation_rad", output_rotation_rad, {0.0, 3.2},
                  "[rad] or when it has turned this far");
    visitor.field("output_rest_interval_s", output_rest_interval_s, {0.1, 1e3},
                  "[s] or when this time has passed, even with little motion; rests do not count");
    visitor.field(
        "drift_rotation", drift_rotation, {0.0, 0.1},
        "[rad/sqrt(s)] random walk per axis, added to the covariance between keyframes for errors "
        "that the smoother does not model: calibration, drifting tracks, synchronisation");
    visitor.field("drift_translation", drift_translation, {0.0, 1.0},
                  "[m/sqrt(s)] random walk per axis, added to the covariance between keyframes");
    visitor.field("tilt_sigma", tilt_sigma, {0.0, 1.5},
                  "[rad] standard deviation of the published verticals, each horizontal axis; "
                  "below 1e-4: no verticals");
    visitor.field(
        "tilt_keyframes", tilt_keyframes, {1, 100000},
        "number of keyframes in a row whose verticals share one error, because biases change "
        "slowly; the optimiser treats the errors as independent, so each vertical gets "
        "sqrt(tilt_keyframes) times tilt_sigma, and beyond 1.5 rad none is published");
    visitor.field("max_imu_gap_s", max_imu_gap_s, {1e-3, 1.0},
                  "[s] longest gap between inertial samples that is interpolated; over a longer "
                  "one images determine the motion, or odometry starts again");
    visitor.field("motion_accel", motion_accel, {1e-3, 1e3},
                  "[m/s^2/sqrt(Hz)] without an inertial sensor: noise density of the acceleration, "
                  "by which the velocity changes; small: smooth motion, short losses of vision are "
                  "bridged better");
    visitor.field("motion_turn", motion_turn, {1e-3, 1e3},
                  "[rad/s^2/sqrt(Hz)] in the same way for the angular acceleration");
    visitor.field("max_speed_mps", max_speed_mps, {0.1, 1e3},
                  "[m/s] a higher estimated speed shows that the estimate has diverged");
    visitor.field(
        "max_gyro_bias_radps", max_gyro_bias_radps, {1e-3, 10.0},
        "[rad/s] a larger estimated bias of the gyroscope shows that the estimate has diverged");
    visitor.field("max_accel_bias_mps2", max_accel_bias_mps2, {1e-2, 50.0},
                  "[m/s^2] a larger estimated bias of the accelerometer shows that the estimate "
                  "has diverged");
  }
};

}  // namespace km
