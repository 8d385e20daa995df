#pragma once

#include <Eigen/Core>

#include "modules/core/geometry.hpp"
#include "modules/core/odometry.hpp"

namespace km {

using Vector7 = Eigen::Matrix<double, 7, 1>;
using Matrix7 = Eigen::Matrix<double, 7, 7>;

/// How the cameras stand to the inertial sensor, beyond what the rig says of both in common.
struct CameraCalibration {
  double offset_s = 0.0;             ///< A stamp of an image and this is the inertial sensor's.
  SE3 T_body_rig = SE3::Identity();  ///< T_body_cam = T_body_rig * the rig's T_body_cam.

  /// Moved by [offset; rotation; translation], the latter about the body's axes and in front:
  /// T_body_rig becomes retract(identity, [rotation; translation]) * T_body_rig.
  [[nodiscard]] CameraCalibration moved(const Vector7& delta) const;

  /// The delta by which `to` has moved from here.
  [[nodiscard]] Vector7 offset_to(const CameraCalibration& to) const;
};

/// Covariance by CameraCalibration::moved().
struct UncertainCalibration {
  CameraCalibration calibration;
  Matrix7 covariance = Matrix7::Zero();
};

/// Pose of the body when an image was taken, for a state of the body `shift_s` before, with its
/// derivatives. Between them the body goes on as it does at the state. Derivatives by velocity and
/// gyro bias, which are proportional to `shift_s`, are left out.
struct ImagePose {
  SE3 T_odom_body = SE3::Identity();
  Eigen::Matrix3d by_state = Eigen::Matrix3d::Identity();  ///< Of rotation and of translation.
  /// By CameraCalibration::moved(): what the cameras see if they move in the body is what they see
  /// if the body moves and they do not.
  Eigen::Matrix<double, 6, 7> by_calibration;

  /// `gyro` is what the gyroscope measures at the state [rad/s].
  [[nodiscard]] static ImagePose at(const OdometryState& state, const Eigen::Vector3d& gyro,
                                    double shift_s);
};

}  // namespace km
