#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "modules/mesh_deformation/mesh_node.hpp"

namespace km {

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

/// Nodes by position, for questions within one radius while nodes are added.
class NodeGrid {
 public:
  /// Nodes seen further apart in time than the window are not near.
  NodeGrid(double radius_m, KeyframeIndex window_keyframes)
      : radius_m_(radius_m), window_keyframes_(window_keyframes) {}

  void insert(const MeshNode& node, std::uint32_t index);

  /// The nearest node within the radius and the window of time; of equals the lowest index;
  /// kNoIndex if there is none.
  [[nodiscard]] std::uint32_t nearest(const Eigen::Vector3d& point, const SeenBy& seen_by) const;

 private:
  struct Entry {
    Eigen::Vector3d position;
    SeenBy seen_by;
    std::uint32_t index;
  };
  double radius_m_;
  KeyframeIndex window_keyframes_;
  std::unordered_map<GridCell, std::vector<Entry>, GridCellHash> cells_;
};

}  // namespace km
