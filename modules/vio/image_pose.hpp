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
  Eigen::Matrix3d by_state = Eigen::Matrix3d::Identity();  ///< For rotation and translation.
  /// By CameraCalibration::retracted(). A motion of the cameras in the body has the same effect on
  /// the images as that motion of the body.
  Eigen::Matrix<double, 6, 7> by_calibration;

  /// `gyro`: angular rate that the gyroscope measures at the state [rad/s].
  [[nodiscard]] static ImagePose at(const OdometryState& state, const Eigen::Vector3d& gyro,
                                    double shift_s);
};

}  // namespace km
