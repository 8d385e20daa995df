#pragma once

#include <Eigen/Core>
#include <optional>

#include "modules/core/camera.hpp"
#include "modules/core/frame.hpp"

namespace km {

/// Inverse depth 1/z [1/m] at a point of the image [px], pixel centres at whole numbers: bilinear
/// in 1/z, in which planes are linear, over those of the four pixels around that have a depth.
/// nullopt if the nearest one has none, or if theirs differ by more than `max_spread` [1/m]: an
/// edge between near and far, where a mean would be the depth of nothing.
[[nodiscard]] std::optional<double> inverse_depth_at(const DepthImage& image,
                                                     const Eigen::Vector2d& px, double max_spread);

/// `max_spread` for inverse_depth_at() with this rig: a step of 1.5 px in the virtual disparity.
/// Smaller ones are as good as noise.
[[nodiscard]] double depth_edge(const StereoRig& rig);

/// True if `image` has the camera's size and as many pixels as that.
[[nodiscard]] bool fits(const GrayImage& image, const Camera& camera);
[[nodiscard]] bool fits(const DepthImage& image, const Camera& camera);

/// True if the frame has the images that the rig takes, of the right size: left and right, or left
/// and, if any, depth.
[[nodiscard]] bool fits(const StereoFrame& frame, const StereoRig& rig);

}  // namespace km
