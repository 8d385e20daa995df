#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "modules/core/geometry/geometry.hpp"
#include "modules/core/stamp.hpp"

namespace km {

/// One landmark seen in a stereo pair. Bearings are undistorted points on z = 1 of each camera.
struct TrackedFeature {
  std::uint64_t id = 0;  ///< Equal ids mean equal landmarks; never reused.
  Eigen::Vector2d left = Eigen::Vector2d::Zero();  ///< Bearing in the left camera.
  std::optional<Eigen::Vector2d> right;            ///< Bearing in the right camera, if matched.
  int length = 1;  ///< Number of images in which it has been tracked.
  /// Derivative of each bearing by the readout time [1/s]: its image velocity times
  /// Camera::row_time().
  Eigen::Vector2d left_by_readout = Eigen::Vector2d::Zero();
  Eigen::Vector2d right_by_readout = Eigen::Vector2d::Zero();
};

/// Output of the feature tracker for one image.
struct TrackedFrame {
  Stamp stamp = 0;
  std::vector<TrackedFeature> features;  ///< Ascending ids.
  /// Motion of the left camera since the image before, on which the features agree.
  std::optional<SE3> T_previous_current = {};
};

}  // namespace km
