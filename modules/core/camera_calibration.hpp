#pragma once

#include <Eigen/Core>

#include "modules/core/camera.hpp"
#include "modules/core/geometry.hpp"

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

  /// Beyond another rig, of which this one came by `correction`. The covariance by moved() is the
  /// same.
  [[nodiscard]] CameraCalibration on_top_of(const CameraCalibration& correction) const;

  /// Inverse of on_top_of(): beyond the rig that `correction` makes of this one.
  [[nodiscard]] CameraCalibration without(const CameraCalibration& correction) const;

  /// Moves the cameras.
  void apply_to(StereoRig& rig) const;
};

/// Covariance by CameraCalibration::moved().
struct UncertainCalibration {
  CameraCalibration calibration;
  Matrix7 covariance = Matrix7::Zero();
};

}  // namespace km
