#pragma once

#include <Eigen/Core>

#include "modules/core/camera/camera.hpp"
#include "modules/core/geometry/geometry.hpp"

namespace km {

/// Number of unknowns of a CameraCalibration.
inline constexpr int kCalibrationSize = 8;
using CalibrationVector = Eigen::Matrix<double, kCalibrationSize, 1>;
using CalibrationMatrix = Eigen::Matrix<double, kCalibrationSize, kCalibrationSize>;

/// Correction of the rig: offset in time, motion of both cameras relative to the inertial sensor,
/// and readout time of their rolling shutters.
struct CameraCalibration {
  /// Added to the stamp of an image to get the inertial sensor's time.
  double offset_s = 0.0;
  SE3 T_body_rig = SE3::Identity();  ///< T_body_cam = T_body_rig * the rig's T_body_cam.
  /// Time from the first to the last row of an image, beyond TrackerConfig::readout_s.
  double readout_s = 0.0;

  /// Perturbation by [offset; rotation; translation; readout time], with rotation and translation
  /// in the body frame and on the left: T_body_rig becomes retract(identity, [rotation;
  /// translation]) * T_body_rig.
  [[nodiscard]] CameraCalibration retracted(const CalibrationVector& delta) const;

  /// The delta for which retracted(delta) is `to`.
  [[nodiscard]] CalibrationVector local_coordinates_to(const CameraCalibration& to) const;

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
  CalibrationMatrix covariance = CalibrationMatrix::Zero();
};

}  // namespace km
