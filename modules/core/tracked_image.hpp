#pragma once

#include <memory>
#include <vector>

#include "modules/core/frame.hpp"

namespace km {

/// A stereo pair as odometry saw it, with or without a pose: for people to look at.
struct TrackedImage {
  std::shared_ptr<const StereoFrame> frame;
  std::vector<Eigen::Vector2d> bearings;  ///< Of its features, on z = 1 of the left camera.
};

}  // namespace km
