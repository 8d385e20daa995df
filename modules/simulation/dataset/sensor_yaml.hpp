#pragma once

#include <string>

#include "modules/core/camera.hpp"

namespace km {

/// Texts of sensor.yaml in the EuRoC/ASL format. Numbers keep the digits that tell doubles apart:
/// the calibration a reader gets is the one that was rendered.
[[nodiscard]] std::string camera_yaml(const PinholeCamera& camera, double rate_hz,
                                      const std::string& comment);

/// A depth camera in the place of `camera`, pixel for pixel.
[[nodiscard]] std::string depth_yaml(const PinholeCamera& camera, double rate_hz,
                                     const std::string& comment);

/// The inertial sensor, which is the body frame.
[[nodiscard]] std::string imu_yaml(const ImuNoise& noise, const std::string& comment);

}  // namespace km
