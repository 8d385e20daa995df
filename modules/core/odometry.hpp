#pragma once

#include <memory>
#include <optional>

#include "modules/core/camera_calibration.hpp"
#include "modules/core/frame.hpp"
#include "modules/core/geometry.hpp"
#include "modules/core/ids.hpp"

namespace km {

/// Estimate of the body's motion at one image. `odom` has z up, against gravity.
struct OdometryState {
  Stamp stamp = 0;
  SE3 T_odom_body = SE3::Identity();
  Eigen::Vector3d v_odom = Eigen::Vector3d::Zero();      ///< [m/s]
  Eigen::Vector3d gyro_bias = Eigen::Vector3d::Zero();   ///< [rad/s]
  Eigen::Vector3d accel_bias = Eigen::Vector3d::Zero();  ///< [m/s^2]
};

/// Of an OdometryState without heading and position, which only say where `odom` is: tilt about x
/// and y of odom [rad], velocity in odom, its direction seen from the heading [m/s], gyro bias
/// [rad/s], accelerometer bias [m/s^2].
using StateCovariance = Eigen::Matrix<double, 11, 11>;

/// Which way is up, as inertial sensing knows it.
struct Vertical {
  Eigen::Vector3d up_body = Eigen::Vector3d::UnitZ();  ///< Unit, against gravity.
  /// Of the tilt about each horizontal axis, errors of keyframes taken as independent.
  double sigma_rad = 0.0;
};

/// A new keyframe as odometry hands it on. Its pose is chained from the relative poses, so that
/// T_odom_kf is constant once published although odometry refines its recent past. Its images, if
/// there are any, are those of the LocatedFrame with its stamp.
struct KeyframeOdometry {
  KeyframeId id;
  Stamp stamp = 0;
  SE3 T_odom_kf = SE3::Identity();        ///< Product of the relative poses up to here.
  SE3 T_previous_kf = SE3::Identity();    ///< Pose in the keyframe before; odom for the first.
  Matrix6 covariance = Matrix6::Zero();   ///< Of T_previous_kf; zero for the first.
  std::optional<Vertical> vertical = {};  ///< Here; none where there is no inertial sensing.
  /// Of the OdometryState here, for a later process to go on from it; none where it is not known.
  std::optional<StateCovariance> state_covariance = {};
  /// How the cameras stood to the inertial sensor, as known here; none where it is not estimated.
  std::optional<UncertainCalibration> calibration = {};
};

/// An image and where its camera was, relative to the keyframes: what is built from such images
/// hangs on the keyframes and moves with them when the pose graph is optimised.
struct LocatedFrame {
  std::shared_ptr<const StereoFrame> frame;
  KeyframeIndex keyframe = 0;         ///< The last one at or before it.
  SE3 T_odom_body = SE3::Identity();  ///< T_odom_kf of that keyframe, then odometry's motion since.
  SE3 T_body_rig = SE3::Identity();   ///< Where the cameras are, by which that was found: see
                                      ///< CameraCalibration.
};

}  // namespace km
