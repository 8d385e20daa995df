#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "modules/core/geometry.hpp"
#include "modules/mesh_deformation/mesh_node.hpp"

namespace km {

/// Moves every vertex of a mesh with the nodes around it, as in Kimera-Multi (Chang et al., ICRA
/// 2021, Sec. IV, Eq. (2) and (3), after Sumner et al., "Embedded Deformation for Shape
/// Manipulation", SIGGRAPH 2007):
///   v' = sum_j w_j [R_j (v - g_j) + t_j],   w_j = (1 - |v - g_j| / d_max)^2, normalised,
/// over the k nearest nodes, with d_max the distance of the next one. Only nodes whose
/// keyframe_gap() to the vertex is within the window are used. With k of these nodes or fewer, the
/// farthest of them gives d_max. A single node moves the vertex alone. With no node, the vertex is
/// not bound and moves with the keyframe that saw it first.
///
/// Stores the nodes of each vertex, so that a new solution costs only one sum per vertex.
class Interpolation {
 public:
  /// `neighbours` is k, limited to 1 to 8; `max_gap_keyframes` is the window.
  Interpolation(std::size_t neighbours, KeyframeIndex max_gap_keyframes);

  /// Binds all vertices to nodes. `vertices` [m] and `seen_by` have equal length.
  void bind(std::span<const Eigen::Vector3f> vertices, std::span<const SeenBy> seen_by,
            std::span<const MeshNode> nodes);

  /// The result of bind() for a mesh that has changed little. `before` gives each vertex's index in
  /// the last call, or kNoIndex if its position or seen_by has changed or it is new. `changed`
  /// lists the nodes that are new or were seen again since the last call. Only vertices near these
  /// nodes and vertices without an index are bound again. Precondition: earlier nodes have kept
  /// their indices and positions.
  void update(std::span<const Eigen::Vector3f> vertices, std::span<const SeenBy> seen_by,
              std::span<const MeshNode> nodes, std::span<const std::uint32_t> before,
              std::span<const std::uint32_t> changed);

  /// The vertices moved with the nodes to `T_world_node` (M_k of the paper, undeformed: identity
  /// rotation and g_k). An unbound vertex moves by T_world_odom_of_kf[its first keyframe].
  [[nodiscard]] std::vector<Eigen::Vector3f> deform(std::span<const Eigen::Vector3f> vertices,
                                                    std::span<const SeenBy> seen_by,
                                                    std::span<const MeshNode> nodes,
                                                    std::span<const SE3> T_world_node,
                                                    std::span<const SE3> T_world_odom_of_kf) const;

  [[nodiscard]] std::size_t vertex_count() const { return rebind_distance_m_.size(); }
  [[nodiscard]] std::size_t unbound_count() const;

  /// The nodes of one vertex, padded with kNoIndex, and their weights, which sum to one if the
  /// vertex is bound.
  [[nodiscard]] std::span<const std::uint32_t> nodes_of(std::size_t vertex) const;
  [[nodiscard]] std::span<const double> weights_of(std::size_t vertex) const;

 private:
  std::size_t neighbours_;
  KeyframeIndex max_gap_keyframes_;
  std::vector<std::uint32_t> nodes_;      // neighbours_ per vertex
  std::vector<double> weights_;           // neighbours_ per vertex
  std::vector<float> rebind_distance_m_;  // a new node nearer than this changes a vertex's nodes
};

}  // namespace km
