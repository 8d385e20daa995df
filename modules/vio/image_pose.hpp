#pragma once

#include <Eigen/Core>

#include "modules/core/geometry.hpp"
#include "modules/core/odometry.hpp"

namespace km {

/// Pose of the body when an image was taken, for a state of the body `shift_s` before, with its
/// derivatives. In between, the body keeps the velocity and angular rate of the state. Derivatives
/// by velocity and gyro bias, which are proportional to `shift_s`, are omitted.
struct ImagePose {
  SE3 T_odom_body = SE3::Identity();
  /// Derivative of the rotation by that of the state, and of the translation by that of the state.
  Eigen::Matrix3d by_state = Eigen::Matrix3d::Identity();
  /// Derivative by the delta of CameraCalibration::retracted(), except for the readout time, which
  /// does not move the image. The images cannot distinguish a
  /// motion of the cameras relative to the body from the same motion of the body. The derivative by
  /// the mounting is therefore that by the pose itself, the identity.
  Eigen::Matrix<double, 6, 7> by_calibration;

  /// `gyro`: angular rate that the gyroscope measures at the state [rad/s].
  [[nodiscard]] static ImagePose at(const OdometryState& state, const Eigen::Vector3d& gyro,
                                    double shift_s);
};

}  // namespace km
