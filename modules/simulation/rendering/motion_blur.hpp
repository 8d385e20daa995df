#pragma once

#include <Eigen/Core>
#include <vector>

#include "modules/core/geometry.hpp"
#include "modules/simulation/rendering/pixel_rays.hpp"

namespace km {

/// How far each pixel's content moves in the image while the shutter is open [px].
///
/// The camera turns and moves with the body: a static point at depth z and bearing b = (x, y, 1)
/// has the image motion -(omega x b + v / z) less its part along b, on the plane z = 1; the
/// camera's own bearings take it to pixels, distortion included.
/// `depth_m`: 0 is infinitely far. `body_velocity` = [rad/s; m/s] in the body frame.
[[nodiscard]] std::vector<Eigen::Vector2f> image_motion(const PixelRays& rays,
                                                        const std::vector<float>& depth_m,
                                                        const Vector6& body_velocity,
                                                        double time_s);

/// Mean of `image` along each pixel's motion, centred on the pixel. Value: float, Eigen::Vector3f.
template <typename Value>
[[nodiscard]] std::vector<Value> blurred(const std::vector<Value>& image, int width, int height,
                                         const std::vector<Eigen::Vector2f>& motion);

}  // namespace km
