#pragma once

#include <array>
#include <optional>

#include "modules/core/geometry.hpp"

namespace km {

/// Pinhole camera with radial-tangential distortion (Brown-Conrady, as OpenCV's first four
/// coefficients). A bearing is a point on the plane z = 1 of the camera frame, undistorted.
struct PinholeCamera {
  int width = 0;                                    ///< [px]
  int height = 0;                                   ///< [px]
  double fx = 0.0, fy = 0.0, cx = 0.0, cy = 0.0;    ///< [px]
  std::array<double, 4> distortion = {0, 0, 0, 0};  ///< k1, k2, p1, p2
  SE3 T_body_cam = SE3::Identity();

  /// Distorted pixel of a bearing [px]; it may lie outside the image.
  [[nodiscard]] Eigen::Vector2d project(const Eigen::Vector2d& bearing) const;

  /// Bearing of a distorted pixel [px]: project() inverted by Newton's method. nullopt where the
  /// distortion has no inverse (far outside the image).
  [[nodiscard]] std::optional<Eigen::Vector2d> unproject(const Eigen::Vector2d& pixel) const;
};

/// Two cameras on one body; [0] is the left, the reference for keypoints and depth.
struct StereoRig {
  std::array<PinholeCamera, 2> cameras;

  [[nodiscard]] SE3 T_left_right() const {
    return cameras[0].T_body_cam.inverse() * cameras[1].T_body_cam;
  }
  [[nodiscard]] double baseline_m() const { return T_left_right().translation().norm(); }
};

/// Continuous-time noise of an inertial sensor.
struct ImuNoise {
  double gyro_noise_density = 1.6968e-04;   ///< [rad/s/sqrt(Hz)]
  double gyro_random_walk = 1.9393e-05;     ///< [rad/s^2/sqrt(Hz)]
  double accel_noise_density = 2.0000e-03;  ///< [m/s^2/sqrt(Hz)]
  double accel_random_walk = 3.0000e-03;    ///< [m/s^3/sqrt(Hz)]
  double rate_hz = 200.0;
};

/// Everything fixed about a robot's sensors.
struct SensorRig {
  StereoRig stereo;
  ImuNoise imu;
};

}  // namespace km
