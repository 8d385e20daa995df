#pragma once

#include <string>

#include "modules/core/camera.hpp"

namespace km {

/// Texts of sensor.yaml in the EuRoC/ASL format. Numbers keep the digits that tell doubles apart:
/// the calibration a reader gets is the one that was rendered.
[[nodiscard]] std::string camera_yaml(const PinholeCamera& camera, double rate_hz,
                                      const std::string& comment);

/// What a depth camera is told apart by from the camera in whose place it is.
struct DepthCameraFigures {
  double rate_hz = 20.0;
  double min_range_m = 0.0;
  double max_range_m = 65.0;
  double baseline_m = 0.1;  ///< Of the stereo camera that would have its errors.
};

/// A depth camera in the place of `camera`, pixel for pixel, with images in mm.
[[nodiscard]] std::string depth_yaml(const PinholeCamera& camera, const DepthCameraFigures& figures,
                                     const std::string& comment);

/// The inertial sensor, which is the body frame.
[[nodiscard]] std::string imu_yaml(const ImuNoise& noise, const std::string& comment);

}  // namespace km
