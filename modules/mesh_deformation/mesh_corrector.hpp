#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "modules/core/geometry.hpp"
#include "modules/core/ids.hpp"
#include "modules/mesh/labelled_mesh.hpp"
#include "modules/mesh/map_mesh.hpp"
#include "modules/mesh_deformation/keyframe_motion.hpp"
#include "modules/mesh_deformation/local_mesh_optimizer.hpp"
#include "modules/mesh_deformation/mesh_deformation_config.hpp"

namespace km {

/// What MeshCorrector::correct() corrects.
struct CorrectionInput {
  const MapMesh& map;
  std::uint64_t map_version = 0;  ///< Differs when the map does.
  std::span<const SE3> T_odom_kf;
  std::span<const SE3> T_world_kf;  ///< May be shorter: see LocalMeshOptimizer::optimize().
};

struct [[nodiscard]] MeshCorrection {
  LabelledMesh mesh;  ///< In the frame of the optimised poses, without superseded surface.
  MeshDeformationReport report;      ///< Of the last optimisation.
  bool deformed = true;              ///< False: that result, moved as a whole.
  SupersededSurface superseded;      ///< Of the map; empty where nothing was deformed.
  std::size_t superseded_faces = 0;  ///< Left out of `mesh`.
};

/// Keeps a mesh up to date with map and trajectory, at the least cost: nothing while no keyframe
/// moved by the configured threshold, one rigid motion where all of them moved alike, as they do
/// when the origin of `world` changes, and Local Mesh Optimization otherwise. After that, drift is
/// out of the mesh and copies of surface that was seen on several visits coincide: of these the
/// best stays (see find_heirs()).
///
/// Not thread-safe.
class MeshCorrector {
 public:
  /// Throws ConfigError if `config` is out of bounds.
  explicit MeshCorrector(const MeshDeformationConfig& config);

  /// The mesh corrected anew, nullopt if the last one still holds. Throws as
  /// LocalMeshOptimizer::optimize().
  [[nodiscard]] std::optional<MeshCorrection> correct(const CorrectionInput& input);

  /// The mesh corrected as if for the first time: depends on nothing but `input`, bit by bit,
  /// however often the mesh was corrected on the way. Throws likewise.
  [[nodiscard]] MeshCorrection correct_afresh(const CorrectionInput& input);

 private:
  [[nodiscard]] MeshCorrection deform(const CorrectionInput& input, std::vector<SE3> anchors);
  [[nodiscard]] std::vector<std::uint32_t> heirs_in(const LabelledMesh& mesh,
                                                    const MapMesh& map) const;

  const double duplicate_voxels_;
  const std::size_t duplicate_faces_;
  const KeyframeIndex window_keyframes_;
  MotionScale scale_;
  LocalMeshOptimizer optimizer_;
  // Of the last optimisation.
  std::optional<std::uint64_t> map_version_;
  std::vector<SE3> anchors_;  // the trajectory, completed
  LabelledMesh optimized_;
  MeshDeformationReport report_;
  SE3 T_published_optimized_ = SE3::Identity();  // how its result has been moved since
};

/// A robot's mesh, corrected to agree with its optimised trajectory.
struct OptimizedMesh {
  RobotId robot = 0;
  RobotId anchor = 0;            ///< Robot whose odometry frame is `world`.
  LabelledMesh mesh;             ///< In `world`.
  MeshDeformationReport report;  ///< Of the last optimisation.
  bool deformed = true;  ///< False: no optimisation was due, the mesh before was moved as a whole.
  double seconds = 0.0;  ///< Time this took.
  std::size_t superseded_faces = 0;  ///< Of the map, left out: another visit saw them better.
};

}  // namespace km
