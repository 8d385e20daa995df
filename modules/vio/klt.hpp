#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "modules/vio/image_pyramid.hpp"

namespace km {

/// Where points were found in another image.
struct KltResult {
  std::vector<Eigen::Vector2f> px;  ///< One for each point; without meaning where not found.
  std::vector<bool> found;          ///< Converged inside the image.
};

/// Pyramidal Lucas-Kanade tracking of the windows around `points` of `from` in `to`, started at
/// `starts` (Bouguet, "Pyramidal Implementation of the Lucas Kanade Feature Tracker", 2001).
/// `levels`: coarsest pyramid level used. `from` needs derivatives.
[[nodiscard]] KltResult track_klt(const ImagePyramid& from, const ImagePyramid& to,
                                  std::span<const Eigen::Vector2f> points,
                                  std::span<const Eigen::Vector2f> starts, int window_px,
                                  int levels);

}  // namespace km
