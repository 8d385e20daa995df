#pragma once

#include "modules/core/camera.hpp"

namespace km {

/// What a calibration is off by, of both cameras in common.
struct RigCorrection {
  double camera_time_offset_s = 0.0;  ///< Added to the stamps of images: the inertial sensor's.
  SE3 T_body_rig = SE3::Identity();   ///< T_body_cam = T_body_rig * the calibration's T_body_cam.

  /// Moves the cameras.
  void apply_to(StereoRig& rig) const {
    for (Camera& camera : rig.cameras) camera.T_body_cam = T_body_rig * camera.T_body_cam;
  }
};

}  // namespace km
