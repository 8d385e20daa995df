#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <unordered_map>
#include <vector>

#include "modules/mesh/labelled_mesh.hpp"
#include "modules/mesh/seen_by.hpp"

namespace km {

/// Stands for "no node", "no vertex" and "no cluster" in lists of indices.
inline constexpr std::uint32_t kNoIndex = std::numeric_limits<std::uint32_t>::max();

/// A cell of a regular grid.
using GridCell = std::array<std::int64_t, 3>;

struct GridCellHash {
  std::size_t operator()(const GridCell& cell) const noexcept {
    // Large odd factors (of splitmix64 and the like) spread neighbouring cells.
    const auto [x, y, z] = cell;
    std::uint64_t h = static_cast<std::uint64_t>(x) * 0x9E3779B97F4A7C15U;
    h = (h ^ (h >> 29U)) + static_cast<std::uint64_t>(y) * 0xBF58476D1CE4E5B9U;
    h = (h ^ (h >> 32U)) + static_cast<std::uint64_t>(z) * 0x94D049BB133111EBU;
    return h ^ (h >> 31U);
  }
};

/// The cell of `point` on a grid of this width. Precondition: |point| / width < 2^63.
[[nodiscard]] inline GridCell grid_cell(const Eigen::Vector3d& point, double width) {
  const Eigen::Vector3d cell = (point / width).array().floor();
  return {static_cast<std::int64_t>(cell.x()), static_cast<std::int64_t>(cell.y()),
          static_cast<std::int64_t>(cell.z())};
}

/// Assigns vertices to clusters, one at a time, as in Rossignac and Borrel, "Multi-resolution 3D
/// approximations for rendering complex scenes" (1993). Vertices of one cell of a grid are in one
/// cluster if their keyframe_gap() to the first vertex of the cluster is within a bound. So
/// surfaces of different visits stay apart.
class VertexClustering {
 public:
  VertexClustering(double width_m, KeyframeIndex max_gap_keyframes)
      : width_m_(width_m), max_gap_keyframes_(max_gap_keyframes) {}

  /// The cluster of a vertex: ascending from 0 in the order of the first vertices.
  std::uint32_t cluster_of(const Eigen::Vector3d& point, const SeenBy& seen_by);

  [[nodiscard]] std::size_t count() const { return seeds_.size(); }
  /// The cell of a cluster.
  [[nodiscard]] const GridCell& cell_of(std::uint32_t cluster) const {
    return seeds_[cluster].cell;
  }

 private:
  struct Seed {
    SeenBy seen_by;
    GridCell cell;
    std::uint32_t next_in_cell;
  };
  double width_m_;
  KeyframeIndex max_gap_keyframes_;
  std::unordered_map<GridCell, std::uint32_t, GridCellHash> first_in_cell_;
  std::vector<Seed> seeds_;
};

/// Faces between three different clusters, each once, ascending. Their lowest corner comes first.
/// Faces with a vertex whose cluster is kNoIndex are left out.
[[nodiscard]] std::vector<LabelledMesh::Face> cluster_faces(
    std::span<const LabelledMesh::Face> faces, std::span<const std::uint32_t> cluster_of_vertex);

}  // namespace km
