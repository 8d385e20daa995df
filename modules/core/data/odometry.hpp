#pragma once

#include <memory>
#include <optional>

#include "modules/core/camera/camera_calibration.hpp"
#include "modules/core/camera/frame.hpp"
#include "modules/core/geometry/geometry.hpp"
#include "modules/core/ids.hpp"

namespace km {

/// Estimate of the body's motion at one image. `odom` has z up, against gravity. Without an
/// inertial sensor gravity is unknown: z is then the upward direction of the left camera at the
/// first image, and x its viewing direction. The gyro bias is then the negative angular rate of the
/// body (see motion_model.hpp), and the accelerometer bias is zero.
struct OdometryState {
  Stamp stamp = 0;
  SE3 T_odom_body = SE3::Identity();
  Eigen::Vector3d v_odom = Eigen::Vector3d::Zero();      ///< [m/s]
  Eigen::Vector3d gyro_bias = Eigen::Vector3d::Zero();   ///< [rad/s]
  Eigen::Vector3d accel_bias = Eigen::Vector3d::Zero();  ///< [m/s^2]
};

/// Covariance of an OdometryState without heading and position, which only define the frame `odom`.
/// Variables: tilt about x and y of odom [rad], velocity in odom, direction of the velocity
/// relative to the heading [m/s], gyro bias [rad/s], accelerometer bias [m/s^2].
using StateCovariance = Eigen::Matrix<double, 11, 11>;

/// The vertical as estimated by inertial sensing.
struct Vertical {
  Eigen::Vector3d up_body = Eigen::Vector3d::UnitZ();  ///< Unit vector against gravity.
  /// Standard deviation of the tilt about each horizontal axis. The errors of keyframes are assumed
  /// to be independent.
  double sigma_rad = 0.0;
};

/// A new keyframe as published by odometry. Its pose is chained from the relative poses, so that
/// T_odom_kf is constant after publication although odometry refines its recent past. Its images,
/// if there are any, are in the LocatedFrame with its stamp.
struct KeyframeOdometry {
  KeyframeId id;
  Stamp stamp = 0;
  SE3 T_odom_kf = SE3::Identity();        ///< Product of the relative poses up to this keyframe.
  SE3 T_previous_kf = SE3::Identity();    ///< Pose in the previous keyframe; the first one in odom.
  Matrix6 covariance = Matrix6::Zero();   ///< Covariance of T_previous_kf; zero for the first.
  std::optional<Vertical> vertical = {};  ///< Absent without inertial sensing.
  /// Covariance of the OdometryState at this keyframe, from which a later process can continue;
  /// absent if unknown.
  std::optional<StateCovariance> state_covariance = {};
  /// Calibration of the cameras as estimated at this keyframe; absent if it is not estimated.
  std::optional<UncertainCalibration> calibration = {};
};

/// An image and the pose of its camera, relative to the keyframes. Results from such images depend
/// on the keyframes and move with them when the pose graph is optimised.
struct LocatedFrame {
  std::shared_ptr<const StereoFrame> frame;
  KeyframeIndex keyframe = 0;  ///< Last keyframe at or before the image.
  /// T_odom_kf of that keyframe, followed by odometry's motion since.
  SE3 T_odom_body = SE3::Identity();
  /// Correction of the rig with which the pose was estimated, see CameraCalibration.
  SE3 T_body_rig = SE3::Identity();
  /// Time from the first to the last row of the image, as for TrackerConfig::readout_s.
  double readout_s = 0.0;
  /// Motion of the body at that time, [rotation; translation] in the body frame [rad/s; m/s].
  Vector6 twist_body = Vector6::Zero();
};

}  // namespace km
