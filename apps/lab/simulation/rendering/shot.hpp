#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "modules/core/geometry/geometry.hpp"

namespace km {

/// Setting of the sensor for one frame.
struct Exposure {
  double gain = 1.0;    ///< Radiance 1 / gain saturates the sensor.
  double time_s = 0.0;  ///< Shutter time, centred on the frame's stamp.
};

/// The sun or a lamp, as seen from the camera.
struct LightSource {
  Eigen::Vector3d to_light_body = Eigen::Vector3d::UnitZ();  ///< Unit vector in the body frame.
  double irradiance = 0.0;  ///< On a surface that faces it; a white wall in the sun has 1.
};

/// Conditions under which one frame was taken.
struct Shot {
  Exposure exposure;
  Vector6 body_velocity = Vector6::Zero();  ///< [rad/s; m/s] in the body frame, at the stamp.
  std::uint64_t noise_seed = 0;     ///< Seed of the image; different for left and right images.
  double light = 1.0;               ///< Factor of all light of the scene, see LightPassages.
  std::vector<LightSource> lights;  ///< Visible sources of glare.
  Eigen::Vector3d down_body = -Eigen::Vector3d::UnitZ();  ///< Direction of gravity in the body.
  std::uint64_t rain_seed = 0;  ///< Seed of the drops; the same for left and right images.
};

}  // namespace km
