#pragma once

#include <memory>
#include <vector>

#include "modules/core/camera/frame.hpp"

namespace km {

/// A stereo pair processed by odometry, with or without a pose, for display.
struct TrackedImage {
  std::shared_ptr<const StereoFrame> frame;
  /// Bearings of its features, on z = 1 of the left camera.
  std::vector<Eigen::Vector2d> bearings;
};

}  // namespace km
