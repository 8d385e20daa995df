#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <limits>

#include "modules/core/ids.hpp"

namespace km {

/// First and last keyframe that saw a piece of surface.
using SeenBy = std::array<KeyframeIndex, 2>;

/// Keyframes between two times of sight; 0 where they overlap.
[[nodiscard]] inline KeyframeIndex keyframe_gap(const SeenBy& a, const SeenBy& b) {
  if (a[0] > b[1]) return a[0] - b[1];
  if (b[0] > a[1]) return b[0] - a[1];
  return 0;
}

/// Stands for "no node" and "no vertex" in lists of indices.
inline constexpr std::uint32_t kNoIndex = std::numeric_limits<std::uint32_t>::max();

/// A mesh vertex of the deformation graph: a vertex of the map's mesh that stands for the surface
/// around it.
struct MeshNode {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< g_k, where the mapper saw it [m].
  SeenBy seen_by = {0, 0};
  std::uint32_t vertex = kNoIndex;  ///< In the map's mesh; kNoIndex once that vertex is gone.
};

}  // namespace km
