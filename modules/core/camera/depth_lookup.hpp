#pragma once

#include <Eigen/Core>
#include <optional>

#include "modules/core/camera/camera.hpp"
#include "modules/core/camera/frame.hpp"

namespace km {

/// Inverse depth 1/z [1/m] at a point of the image [px], pixel centres at integers. It is bilinear
/// in 1/z, in which planes are linear, over the neighbouring pixels with a depth (at most four).
/// nullopt if the nearest pixel has no depth. nullopt also if the depths differ by more than
/// `max_spread` [1/m], because at an edge between near and far a mean would be no depth of the
/// scene.
[[nodiscard]] std::optional<double> inverse_depth_at(const DepthImage& image,
                                                     const Eigen::Vector2d& px, double max_spread);

/// `max_spread` for inverse_depth_at() with this rig: a step of 1.5 px in the virtual disparity.
/// Smaller steps are within the noise.
[[nodiscard]] double depth_edge_threshold(const StereoRig& rig);

/// True if `image` has the camera's size and as many pixels.
[[nodiscard]] bool fits(const GrayImage& image, const Camera& camera);
[[nodiscard]] bool fits(const DepthImage& image, const Camera& camera);

/// True if the frame has the images of the rig in the right size: left and right, or left and, if
/// there is one, depth.
[[nodiscard]] bool fits(const StereoFrame& frame, const StereoRig& rig);

}  // namespace km
