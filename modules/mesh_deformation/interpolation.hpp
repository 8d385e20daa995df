#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "modules/core/geometry/geometry.hpp"
#include "modules/mesh_deformation/mesh_node.hpp"

namespace km {

/// Largest number of nodes that move a vertex: the paper's k.
inline constexpr std::size_t kMaxNeighbours = 4;

/// The nodes of one vertex, padded with kNoIndex, and their weights, which sum to one if the vertex
/// is bound. A vertex without a node is not bound.
struct Binding {
  std::array<std::uint32_t, kMaxNeighbours> nodes;
  std::array<double, kMaxNeighbours> weights;

  [[nodiscard]] bool is_bound() const { return nodes.front() != kNoIndex; }
};

/// Binds every vertex of a mesh to the nodes around it, as in Kimera-Multi (Chang et al., ICRA
/// 2021, Sec. IV, Eq. (3), after Sumner et al., "Embedded Deformation for Shape Manipulation",
/// SIGGRAPH 2007):
///   w_j = (1 - |v - g_j| / d_max)^2, normalised,
/// over the k nearest nodes, with d_max the distance of the next one. Only nodes whose
/// keyframe_gap() to the vertex is at most `max_gap_keyframes` are used. With k of these nodes or
/// fewer, the farthest of them gives d_max. A single node moves the vertex alone.
///
/// `vertices` [m] and `seen_by` have equal length; `neighbours` is k, from 1 to kMaxNeighbours.
[[nodiscard]] std::vector<Binding> bind_to_nodes(std::span<const Eigen::Vector3f> vertices,
                                                 std::span<const SeenBy> seen_by,
                                                 std::span<const MeshNode> nodes,
                                                 std::size_t neighbours,
                                                 KeyframeIndex max_gap_keyframes);

/// The vertices moved with their nodes, Eq. (2): v' = sum_j w_j [R_j (v - g_j) + t_j].
/// `T_world_node` are M_k of the paper (undeformed: identity rotation and g_k). A vertex that is
/// not bound moves by T_world_odom_of_kf[the first keyframe that saw it].
[[nodiscard]] std::vector<Eigen::Vector3f> deform_vertices(
    std::span<const Eigen::Vector3f> vertices, std::span<const SeenBy> seen_by,
    std::span<const MeshNode> nodes, std::span<const Binding> bindings,
    std::span<const SE3> T_world_node, std::span<const SE3> T_world_odom_of_kf);

}  // namespace km
