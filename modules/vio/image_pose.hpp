#pragma once

#include <Eigen/Core>

#include "modules/core/geometry.hpp"
#include "modules/core/odometry.hpp"

namespace km {

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
