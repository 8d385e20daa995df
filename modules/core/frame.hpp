#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "modules/core/geometry.hpp"
#include "modules/core/stamp.hpp"

namespace km {

/// 8-bit grey image, row-major without padding: pixels.size() == width * height.
struct GrayImage {
  int width = 0;   ///< [px]
  int height = 0;  ///< [px]
  std::vector<std::uint8_t> pixels;
};

/// A stereo pair taken at one instant.
struct StereoFrame {
  Stamp stamp = 0;
  GrayImage left;
  GrayImage right;
};

/// One inertial sample in the body frame.
struct ImuSample {
  Stamp stamp = 0;
  Eigen::Vector3d gyro = Eigen::Vector3d::Zero();   ///< Angular rate [rad/s].
  Eigen::Vector3d accel = Eigen::Vector3d::Zero();  ///< Specific force [m/s^2]: at rest, minus g.
};

/// A stereo pair and the inertial samples since the one before, in order of time. The last sample
/// is the first at or after the frame's stamp, so that the interval is covered; it is repeated as
/// the first of the next packet.
struct SensorPacket {
  std::shared_ptr<const StereoFrame> frame;
  std::vector<ImuSample> imu;
};

}  // namespace km
