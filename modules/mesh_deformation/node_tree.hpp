#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "modules/mesh_deformation/mesh_node.hpp"

namespace km {

/// A node and its squared distance [m^2] from where it was asked for.
struct NearNode {
  double distance2 = 0.0;
  std::uint32_t node = kNoIndex;
};

/// Nearest nodes in space among those that are near in time: a k-d tree of fixed nodes.
class NodeTree {
 public:
  /// Of all `nodes`, or of those listed. They are copied.
  NodeTree(std::span<const MeshNode> nodes, KeyframeIndex window_keyframes);
  NodeTree(std::span<const MeshNode> nodes, std::span<const std::uint32_t> listed,
           KeyframeIndex window_keyframes);
  ~NodeTree();
  NodeTree(const NodeTree&) = delete;
  NodeTree& operator=(const NodeTree&) = delete;

  /// Fills `found` with the nearest nodes whose time of sight is within the window of `seen_by`, by
  /// distance. Returns how many there are.
  std::size_t nearest(const Eigen::Vector3d& point, const SeenBy& seen_by,
                      std::span<NearNode> found) const;

  /// Is any such node closer than the root of distance2?
  [[nodiscard]] bool any_within(const Eigen::Vector3d& point, const SeenBy& seen_by,
                                double distance2) const;

 private:
  struct Tree;
  std::unique_ptr<Tree> tree_;
};

}  // namespace km
