#pragma once

#include "modules/core/config.hpp"

namespace km {

/// Parameters of Vio without its feature tracker.
struct VioConfig {
  static constexpr const char* kSection = "vio";

  int window_keyframes = 7;
  double noise_px = 0.7;
  double loss_scale = 1.5;
  double outlier_px = 3.0;
  double gyro_noise_factor = 8.0;
  double accel_noise_factor = 12.0;
  double gravity_mps2 = 9.81;
  double accel_bias_sigma = 0.05;
  bool calibrate = true;
  double calibration_offset_s = 0.01;
  double calibration_readout_s = 0.01;
  double start_s = 0.75;
  double rest_s = 1.0;
  double output_interval_s = 0.3;
  double output_distance_m = 0.1;
  double output_rest_interval_s = 2.0;
  double drift_rotation = 4e-4;
  double drift_translation = 3e-3;
  double tilt_sigma = 1e-2;
  double max_imu_gap_s = 0.1;
  double motion_accel = 10.0;
  double motion_turn = 5.0;
  double max_speed_mps = 30.0;

  void visit_fields(auto& visitor) {
    visitor.field(
        "window_keyframes", window_keyframes, {3, 50},
        "number of keyframes in the window of the smoother; more: more accurate and slower");
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
    visitor.field(
        "calibrate", calibrate,
        "estimates corrections to the stamps, to the mounting and to the readout time of the "
        "cameras, common to both cameras");
    visitor.field("calibration_offset_s", calibration_offset_s, {1e-9, 1.0},
                  "[s] standard deviation of the correction to the stamps at the start; small: no "
                  "correction");
    visitor.field("calibration_readout_s", calibration_readout_s, {1e-9, 1.0},
                  "[s] standard deviation of the correction to tracker.readout_s at the start; "
                  "small: no correction");
    visitor.field(
        "start_s", start_s, {0.2, 5.0},
        "[s] duration of the images held back for a start; their poses are published after it");
    visitor.field("rest_s", rest_s, {0.1, 1e6},
                  "[s] after this time without motion the body is at rest and makes no keyframes "
                  "until it moves");
    visitor.field("output_interval_s", output_interval_s, {0.0, 10.0},
                  "[s] smallest interval between published keyframes");
    visitor.field(
        "output_distance_m", output_distance_m, {0.0, 10.0},
        "[m] after that interval, a keyframe is published when the body has moved this far, or "
        "turned by 0.1 rad");
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
  }
};

}  // namespace km
