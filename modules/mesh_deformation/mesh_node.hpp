#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <limits>

#include "modules/core/ids.hpp"

namespace km {

/// First and last keyframe that saw a piece of surface.
using SeenBy = std::array<KeyframeIndex, 2>;

/// Keyframes between the last one that saw the earlier surface and the first one that saw the later
/// surface; 0 if the two intervals overlap.
[[nodiscard]] inline KeyframeIndex keyframe_gap(const SeenBy& a, const SeenBy& b) {
  if (a[0] > b[1]) return a[0] - b[1];
  if (b[0] > a[1]) return b[0] - a[1];
  return 0;
}

/// Stands for "no node" and "no vertex" in lists of indices.
inline constexpr std::uint32_t kNoIndex = std::numeric_limits<std::uint32_t>::max();

/// A mesh vertex of the deformation graph: a vertex of the map's mesh that represents the surface
/// around it.
struct MeshNode {
  /// g_k, position according to the mapper [m].
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  SeenBy seen_by = {0, 0};
};

}  // namespace km
