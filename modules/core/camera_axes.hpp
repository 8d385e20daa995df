#pragma once

#include <Eigen/Core>

namespace km {

/// Rotation R_body_cam from the axes of a camera (x right, y down, z forward) to those of a body
/// (x forward, y left, z up) that looks the same way.
[[nodiscard]] inline Eigen::Matrix3d body_axes_of_camera() {
  Eigen::Matrix3d R_body_cam;
  R_body_cam << 0.0, 0.0, 1.0,  //
      -1.0, 0.0, 0.0,           //
      0.0, -1.0, 0.0;
  return R_body_cam;
}

}  // namespace km
