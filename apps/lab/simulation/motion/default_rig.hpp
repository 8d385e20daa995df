#pragma once

#include "modules/core/camera/camera.hpp"

namespace km {

enum class RigKind {
  kFlying,   ///< EuRoC's: baseline 0.11 m, body frame of its IMU (x up, z forward).
  kVehicle,  ///< EuRoC's optics looking along the vehicle's x axis: baseline 0.27 m, body x
             ///< forward.
};

/// The published calibration of EuRoC's cameras (Burri et al., IJRR 2016) at another resolution:
/// scaled to the width, cut or extended around the image's centre in height. The noise is that of
/// the ADIS16448 as published.
[[nodiscard]] SensorRig default_rig(RigKind kind, int width, int height);

/// Rotation of the body in the vehicle's frame (x forward, y left, z up), R_vehicle_body.
[[nodiscard]] Eigen::Matrix3d vehicle_from_body(RigKind kind);

}  // namespace km
