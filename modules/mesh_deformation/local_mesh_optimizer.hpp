#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string_view>

#include "modules/core/geometry.hpp"
#include "modules/mesh/map_mesh.hpp"
#include "modules/mesh_deformation/deformation_graph.hpp"
#include "modules/mesh_deformation/mesh_deformation_config.hpp"

namespace km {

/// Throws std::invalid_argument for poses that are not finite or not rigid, for more optimised
/// poses than keyframes, and for keyframes without any optimised pose.
void check_trajectories(std::span<const SE3> T_odom_kf, std::span<const SE3> T_world_kf);

/// Sizes and outcome of one call of LocalMeshOptimizer::optimize().
struct MeshDeformationReport {
  std::size_t vertices = 0;
  /// Vertices without a node in their time window, moved with the keyframe that saw them first.
  std::size_t unbound_vertices = 0;
  std::size_t nodes = 0;
  std::size_t new_nodes = 0;
  std::size_t keyframes = 0;
  bool warm = false;  ///< Started from an earlier solution.
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
/// Incremental: the graph is kept from call to call. New surface extends it, known vertices keep
/// their nodes, and the last solution is the first guess of the next. Vertices are identified by
/// their ids; without ids all are new. When more than half as many vertices have
/// been removed as remain, the graph is built again, and the solution starts from the keyframes.
/// reset() discards everything.
///
/// Deviations from the paper: surfaces seen at distant times (see MeshDeformationConfig) share no
/// edge of the graph. They do not move each other's vertices, because there is drift between them.
/// The other deviation is the weak term of solve().
///
/// Not thread-safe.
class LocalMeshOptimizer {
 public:
  /// Throws ConfigError if `config` is out of bounds.
  explicit LocalMeshOptimizer(const MeshDeformationConfig& config = {},
                              const DeformationStop& stop = {});
  ~LocalMeshOptimizer();
  LocalMeshOptimizer(LocalMeshOptimizer&&) noexcept;
  LocalMeshOptimizer& operator=(LocalMeshOptimizer&&) noexcept;

  /// Returns the corrected mesh. `T_odom_kf` are the keyframes' poses with which the mesh was
  /// built, index i being keyframe i; `T_world_kf` are their optimised poses. Keyframes at the end
  /// without an optimised pose follow, by odometry, the last keyframe that has one.
  ///
  /// Throws std::invalid_argument if fault_of() finds a fault in the map, or check_trajectories()
  /// refuses the poses. Also throws if keyframes that saw a vertex do not exist, or if there are
  /// fewer keyframes than in the call before. The state is then unchanged.
  DeformedMesh optimize(const MapMesh& map, std::span<const SE3> T_odom_kf,
                        std::span<const SE3> T_world_kf);

  void reset();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace km
