#pragma once

#include <Eigen/Core>

#include "modules/core/camera.hpp"
#include "modules/core/geometry.hpp"

namespace km {

using Vector7 = Eigen::Matrix<double, 7, 1>;
using Matrix7 = Eigen::Matrix<double, 7, 7>;

/// Correction of the rig: offset in time and motion of both cameras relative to the inertial
/// sensor.
struct CameraCalibration {
  /// Added to the stamp of an image to get the inertial sensor's time.
  double offset_s = 0.0;
  SE3 T_body_rig = SE3::Identity();  ///< T_body_cam = T_body_rig * the rig's T_body_cam.

  /// Perturbation by [offset; rotation; translation], with rotation and translation in the body
  /// frame and on the left: T_body_rig becomes retract(identity, [rotation; translation]) *
  /// T_body_rig.
  [[nodiscard]] CameraCalibration retracted(const Vector7& delta) const;

  /// The delta for which retracted(delta) is `to`.
  [[nodiscard]] Vector7 local_coordinates_to(const CameraCalibration& to) const;

  /// This correction relative to the rig before `correction` was applied to it. The covariance by
  /// retracted() does not change.
  [[nodiscard]] CameraCalibration composed_with(const CameraCalibration& correction) const;

  /// Inverse of composed_with(): this correction relative to the rig after `correction`.
  [[nodiscard]] CameraCalibration without(const CameraCalibration& correction) const;

  /// Moves the cameras of `rig`.
  void apply_to(StereoRig& rig) const;
};

/// Calibration and its covariance in the coordinates of CameraCalibration::retracted().
struct UncertainCalibration {
  CameraCalibration calibration;
  Matrix7 covariance = Matrix7::Zero();
};

}  // namespace km
