#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "modules/core/geometry/geometry.hpp"
#include "modules/mesh/map_mesh.hpp"
#include "modules/mesh_deformation/deformation_graph.hpp"
#include "modules/mesh_deformation/mesh_deformation_config.hpp"

namespace km {

/// Throws std::invalid_argument for poses that are not finite or not rigid, for more optimised
/// poses than keyframes, and for keyframes without any optimised pose.
void check_trajectories(std::span<const SE3> T_odom_kf, std::span<const SE3> T_world_kf);

/// Optimised poses of all keyframes of `T_odom_kf`. Keyframes at the end that `T_world_kf` lacks
/// follow its last pose by odometry. Precondition: `T_world_kf` is not longer than `T_odom_kf`, and
/// is empty only if `T_odom_kf` is.
[[nodiscard]] std::vector<SE3> complete(std::span<const SE3> T_odom_kf,
                                        std::span<const SE3> T_world_kf);

/// Sizes and outcome of one optimisation.
struct MeshDeformationReport {
  std::size_t vertices = 0;
  /// Vertices without a node in their time window, moved with the keyframe that saw them first.
  std::size_t unbound_vertices = 0;
  std::size_t nodes = 0;
  std::size_t keyframes = 0;
  DeformationStatus status = DeformationStatus::kConverged;
  int iterations = 0;
};

struct [[nodiscard]] DeformedMesh {
  LabelledMesh mesh;  ///< In the frame of the optimised poses.
  MeshDeformationReport report;
};

/// Local Mesh Optimization (Chang, Tian, How, Carlone, "Kimera-Multi", ICRA 2021, Sec. IV): deforms
/// the mesh that a robot's mapper built on odometry so that it agrees with the optimised poses of
/// the keyframes. The mesh is simplified to the nodes of a deformation graph, the graph is solved,
/// and every vertex is moved with the nodes around it. Faces, labels and colours do not change.
///
/// Deviations from the paper: surfaces seen at distant times (see MeshDeformationConfig) share no
/// edge of the graph. They do not move each other's vertices, because there is drift between them.
/// The other deviation is the weak term of solve().
///
/// `T_odom_kf` are the keyframes' poses with which the mesh was built, index i being keyframe i;
/// `T_world_kf` are their optimised poses. Keyframes at the end without an optimised pose follow,
/// by odometry, the last keyframe that has one.
///
/// Throws std::invalid_argument if fault_of() finds a fault in the map, or check_trajectories()
/// refuses the poses, or keyframes that saw a vertex do not exist.
[[nodiscard]] DeformedMesh optimize_mesh(const MapMesh& map, std::span<const SE3> T_odom_kf,
                                         std::span<const SE3> T_world_kf,
                                         const MeshDeformationConfig& config = {});

}  // namespace km
