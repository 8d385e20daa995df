#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "modules/core/data/pose_graph.hpp"
#include "modules/core/geometry/geometry.hpp"
#include "modules/core/ids.hpp"
#include "modules/mesh/labelled_mesh.hpp"
#include "modules/mesh/map_mesh.hpp"
#include "modules/mesh/mesh_origin.hpp"
#include "modules/mesh_deformation/local_mesh_optimization.hpp"
#include "modules/mesh_deformation/mesh_deformation_config.hpp"
#include "modules/mesh_deformation/mesh_node.hpp"

namespace km {

/// Input of MeshCorrector::correct().
struct CorrectionInput {
  const MapMesh& map;
  std::uint64_t map_version = 0;  ///< Changes whenever the map does.
  std::span<const SE3> T_odom_kf;
  std::span<const SE3> T_world_kf;            ///< May be shorter than T_odom_kf, see optimize().
  std::span<const Matrix6> covariances = {};  ///< Those of T_world_kf; empty: unknown.
};

struct [[nodiscard]] MeshCorrection {
  LabelledMesh mesh;  ///< In the frame of the optimised poses, without superseded surface.
  MeshDeformationReport report;      ///< Report of the last optimisation.
  SupersededSurface superseded;      ///< Surface the mapper may drop.
  std::size_t superseded_faces = 0;  ///< Faces of the map that another visit saw better.
  std::size_t seen_through = 0;      ///< Faces of the map that later views saw through.
  MeshOrigin origin = {};            ///< Keyframes that saw `mesh`.
};

/// Which copies of surface from several visits stay in a mesh of more than
/// MeshDeformationConfig::duplicate_faces faces.
struct CopyLimits {
  /// Largest distance of a copy from the best ones, after correction, at which it is dropped
  /// permanently from mesh and map; 0: all copies stay.
  double voxels = 1.0;
  std::size_t copies = 2;  ///< Number of copies that stay. With one, walls have holes.
  /// Number of faces of further copies, as a share of all other faces, above which they are
  /// dropped. Memory is proportional to 1 + share.
  double share = 0.5;
};

/// Keeps a mesh consistent with map and trajectory. Local Mesh Optimization deforms it when the map
/// has changed, or when a keyframe has moved by more than 1 cm or 5 mrad. This removes drift,
/// so that copies of surface from several visits coincide. If a mesh of more than duplicate_faces
/// has more copies than CopyLimits permit, only the best ones stay (see
/// find_replacements()).
///
/// Surface that several later views of the map saw through is left out of the mesh (SightVotes): it
/// has moved away. The test uses the present poses and their covariances, and is repeated with each
/// deformation, so that surface returns if a wrong pose was the reason. The mapper may drop it when
/// two successive searches for copies find it gone. Without covariances nothing is left out.
///
/// Not thread-safe.
class MeshCorrector {
 public:
  /// Throws ConfigError if `config` is out of bounds.
  explicit MeshCorrector(const MeshDeformationConfig& config, const CopyLimits& limits = {});

  /// Returns the corrected mesh, or nullopt if the last one is still valid. Throws under the
  /// conditions of optimize_mesh().
  [[nodiscard]] std::optional<MeshCorrection> correct(const CorrectionInput& input);

  /// Returns the mesh as from a first correction. The mesh depends only on `input`, bit by bit, and
  /// not on earlier corrections. Throws under the conditions of optimize_mesh().
  [[nodiscard]] MeshCorrection correct_from_scratch(const CorrectionInput& input);

 private:
  [[nodiscard]] MeshCorrection deform(const CorrectionInput& input, std::vector<SE3> anchors);
  [[nodiscard]] std::vector<bool> seen_through(const CorrectionInput& input,
                                               const std::vector<Eigen::Vector3f>& vertices) const;
  [[nodiscard]] bool has_many_copies(const MapMesh& map) const;
  [[nodiscard]] std::vector<std::uint32_t> copies_in(const LabelledMesh& mesh, const MapMesh& map,
                                                     const std::vector<std::uint32_t>& kept) const;
  [[nodiscard]] SupersededSurface droppable(const MapMesh& map,
                                            const std::vector<std::uint32_t>& kept,
                                            std::span<const std::uint32_t> replacements);

  const MeshDeformationConfig config_;
  const CopyLimits limits_;
  // Result of the last search for copies.
  std::size_t distinct_faces_ = 0;   // faces that stayed
  std::vector<std::uint64_t> gone_;  // vertices of the map that had been seen through, ascending
  // The last optimisation.
  std::optional<std::uint64_t> map_version_;
  std::vector<SE3> anchors_;  // complete() of the trajectory
};

/// A robot's mesh, corrected to agree with its optimised trajectory.
struct OptimizedMesh : MeshCorrection {
  RobotId robot = 0;
  RobotId anchor = 0;  ///< Robot whose odometry frame is `world`.
  std::shared_ptr<const Trajectory> trajectory = nullptr;  ///< Poses to which it was corrected.
  double seconds = 0.0;                                    ///< Duration of the correction.
  /// T_world_kf * T_odom_kf^-1 of the poses in `origin`: where the correction moved what they saw.
  std::vector<SE3> T_world_odom = {};
};

}  // namespace km
