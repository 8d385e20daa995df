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

/// Throws std::invalid_argument that names the first problem: `seen_by` not as long as the
/// vertices, first after last keyframe, a keyframe from `keyframes` on, a vertex that is not finite
/// or beyond 10,000 km, a face that names a vertex which does not exist, ids not as long as the
/// vertices or not ascending, certainty not as long as the vertices.
void check_map_mesh(const MapMesh& map, std::size_t keyframes);

/// Throws std::invalid_argument that names the first pose that is not finite or not rigid; `what`
/// says which poses these are.
void check_poses(std::span<const SE3> poses, std::string_view what);

/// Throws std::invalid_argument for poses that check_poses() refuses, more optimised poses than
/// keyframes, and none though there are some.
void check_trajectories(std::span<const SE3> T_odom_kf, std::span<const SE3> T_world_kf);

/// Sizes and outcome of one call of LocalMeshOptimizer::optimize().
struct MeshDeformationReport {
  std::size_t vertices = 0;
  std::size_t unbound_vertices = 0;  ///< No node was near in time: moved with their keyframe.
  std::size_t nodes = 0;
  std::size_t new_nodes = 0;
  std::size_t keyframes = 0;
  std::size_t edges = 0;
  std::size_t ties = 0;
  bool warm = false;  ///< Started from an earlier solution.
  DeformationStatus status = DeformationStatus::kConverged;
  int iterations = 0;
  double initial_cost = 0.0;
  double final_cost = 0.0;
};

struct [[nodiscard]] DeformedMesh {
  LabelledMesh mesh;  ///< In the frame of the optimised poses.
  MeshDeformationReport report;
};

/// Local Mesh Optimization (Chang, Tian, How, Carlone, "Kimera-Multi", ICRA 2021, Sec. IV): bends
/// the mesh that a robot's mapper built on odometry so that it agrees with the optimised poses of
/// the keyframes. The mesh is simplified to the nodes of a deformation graph, the graph solved, and
/// every vertex moved with the nodes around it. Faces, labels and colours are untouched.
///
/// Incremental: the graph is kept from call to call. Surface that is new extends it, known vertices
/// keep their nodes, and the last solution starts the next. Vertices are known again by their ids,
/// else by index and position. Once half as many vertices have gone as the mesh has, the graph is
/// made anew, and the solution starts from the keyframes. reset() forgets all.
///
/// Deviations from the paper: surfaces seen at distant times (see MeshDeformationConfig) neither
/// share an edge of the graph nor move each other's vertices, for drift lies between them; and the
/// weak term of solve().
///
/// Not thread-safe.
class LocalMeshOptimizer {
 public:
  /// Throws ConfigError if `config` is out of bounds.
  explicit LocalMeshOptimizer(const MeshDeformationConfig& config = {});
  ~LocalMeshOptimizer();
  LocalMeshOptimizer(LocalMeshOptimizer&&) noexcept;
  LocalMeshOptimizer& operator=(LocalMeshOptimizer&&) noexcept;

  /// The mesh corrected. `T_odom_kf` are the keyframes' poses the mesh was built with, index i
  /// being keyframe i; `T_world_kf` their optimised poses. Keyframes at the end that have no
  /// optimised pose yet follow the last one that has. Throws std::invalid_argument, the state
  /// unchanged, for a mesh that check_map_mesh() refuses, poses that are not finite or not rigid,
  /// more optimised poses than keyframes, or none though there are some, and fewer keyframes than
  /// in the call before.
  DeformedMesh optimize(const MapMesh& map, std::span<const SE3> T_odom_kf,
                        std::span<const SE3> T_world_kf);

  void reset();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace km
