#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <unordered_map>
#include <vector>

#include "modules/core/ids.hpp"
#include "modules/mesh/grid_cell.hpp"

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
  /// Index in the map's mesh; kNoIndex after that vertex was removed.
  std::uint32_t vertex = kNoIndex;
};

/// Nodes by position, for searches within one radius while nodes are added.
class NodeGrid {
 public:
  /// Nodes whose keyframe_gap() exceeds `max_gap_keyframes` are not near.
  NodeGrid(double radius_m, KeyframeIndex max_gap_keyframes)
      : radius_m_(radius_m), max_gap_keyframes_(max_gap_keyframes) {}

  void insert(const MeshNode& node, std::uint32_t index);

  /// Index of the nearest node within the radius whose keyframe_gap() to `seen_by` is at most the
  /// limit of this index. At equal distance the lowest index; kNoIndex if there is no such node.
  [[nodiscard]] std::uint32_t nearest(const Eigen::Vector3d& point, const SeenBy& seen_by) const;

 private:
  struct Entry {
    Eigen::Vector3d position;
    SeenBy seen_by;
    std::uint32_t index;
  };
  double radius_m_;
  KeyframeIndex max_gap_keyframes_;
  std::unordered_map<GridCell, std::vector<Entry>, GridCellHash> cells_;
};

}  // namespace km
