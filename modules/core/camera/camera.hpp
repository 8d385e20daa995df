#pragma once

#include <array>
#include <optional>

#include "modules/core/camera/lens.hpp"
#include "modules/core/geometry/geometry.hpp"

namespace km {

/// A central camera: a lens and an image plane. A bearing is a point on the plane z = 1 of the
/// camera frame, undistorted. Only points within the lens's disc have one (see Lens).
struct Camera {
  int width = 0;                                  ///< [px]
  int height = 0;                                 ///< [px]
  double fx = 0.0, fy = 0.0, cx = 0.0, cy = 0.0;  ///< [px]; focal lengths on the axis
  Lens lens = {};
  SE3 T_body_cam = SE3::Identity();

  /// Distorted pixel of a bearing [px]; it may lie outside the image. nullopt if the lens has no
  /// such bearing.
  [[nodiscard]] std::optional<Eigen::Vector2d> project(const Eigen::Vector2d& bearing) const;

  /// Distorted pixel of a ray of any length in the camera frame [px]; it may lie outside the image.
  /// nullopt if the ray does not point forward or the lens has no such bearing.
  [[nodiscard]] std::optional<Eigen::Vector2d> project_ray(const Eigen::Vector3d& ray) const;

  /// Bearing of a distorted pixel [px]; nullopt if no bearing of the lens has that pixel.
  [[nodiscard]] std::optional<Eigen::Vector2d> unproject(const Eigen::Vector2d& pixel) const;

  /// Time by which a rolling shutter exposes row `y` [px] later than the middle row, as a share of
  /// the readout time: -0.5 .. 0.5 in the image.
  [[nodiscard]] double row_time(double y) const { return (y + 0.5) / height - 0.5; }
};

/// Source of the depth of single image points.
enum class DepthSource {
  kRightImage,  ///< Stereo: cameras[1] takes the right image.
  kDepthImage,  ///< RGB-D: frames have a depth image and no right one; cameras[1] is virtual.
};

/// Two cameras on one body; [0] is the left, the reference for keypoints and depth.
///
/// In an RGB-D rig the right camera is a virtual one (see rgbd_rig()): depth z corresponds to the
/// disparity f * baseline / z. Algorithms for stereo observations therefore work with it too. An
/// error of one pixel corresponds to an error of z^2 / (f * baseline) in depth (as in Mur-Artal and
/// Tardos, "ORB-SLAM2: an open-source SLAM system for monocular, stereo and RGB-D cameras", 2017).
struct StereoRig {
  std::array<Camera, 2> cameras;
  DepthSource depth_source = DepthSource::kRightImage;

  [[nodiscard]] SE3 T_left_right() const {
    return cameras[0].T_body_cam.inverse() * cameras[1].T_body_cam;
  }
  [[nodiscard]] double baseline_m() const { return T_left_right().translation().norm(); }
};

/// Rig of an RGB-D camera: `camera` and a virtual copy of it, `baseline_m` to the right. The larger
/// the baseline, the larger the weight of the depth. Use the baseline of a sensor that measures
/// depth by stereo or structured light, or otherwise a baseline b for which depth errors are
/// about z^2 * 1 px / (f * b). Throws std::invalid_argument unless the baseline is positive and
/// finite.
[[nodiscard]] StereoRig rgbd_rig(const Camera& camera, double baseline_m);

/// Distances along the optical axis that a depth sensor measures [m]; values outside count as no
/// depth.
struct DepthRange {
  double min_m = 0.0;
  double max_m = 65.0;
};

/// Continuous-time noise of an inertial sensor.
struct ImuNoise {
  double gyro_noise_density = 1.6968e-04;   ///< [rad/s/sqrt(Hz)]
  double gyro_random_walk = 1.9393e-05;     ///< [rad/s^2/sqrt(Hz)]
  double accel_noise_density = 2.0000e-03;  ///< [m/s^2/sqrt(Hz)]
  double accel_random_walk = 3.0000e-03;    ///< [m/s^3/sqrt(Hz)]
  double rate_hz = 200.0;
};

/// All constant properties of a robot's sensors.
struct SensorRig {
  StereoRig stereo;
  ImuNoise imu;
  std::optional<DepthRange> depth;  ///< Absent: no frame has a depth image.
  bool has_imu = true;              ///< False: there are no inertial samples; `imu` is not used.
};

}  // namespace km
