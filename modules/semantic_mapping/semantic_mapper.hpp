#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include "modules/core/camera.hpp"
#include "modules/core/frame.hpp"
#include "modules/core/geometry.hpp"
#include "modules/core/ids.hpp"
#include "modules/core/label_palette.hpp"
#include "modules/mesh/map_mesh.hpp"
#include "modules/semantic_mapping/incremental_mesh.hpp"
#include "modules/semantic_mapping/semantic_mapping_config.hpp"

namespace km {

/// What became of a frame.
enum class IntegrationStatus {
  kIntegrated,
  kDepthSizeDiffers,  ///< The depth image is not of the camera's size: frame skipped.
  kPoseUnusable,      ///< Not finite, or not a rotation: frame skipped.
};

/// "integrated", "depth image of another size", ...
[[nodiscard]] const char* to_string(IntegrationStatus status);

/// What integrate() did. All zero but status for a frame that was skipped.
struct [[nodiscard]] IntegrationReport {
  IntegrationStatus status = IntegrationStatus::kIntegrated;
  std::size_t pixels = 0;            ///< With a depth within range, after rectification.
  std::size_t labels_outside = 0;    ///< Pixels whose label the palette lacks: unknown.
  bool label_size_differs = false;   ///< Labels not of the camera's size: integrated without.
  std::size_t blocks_updated = 0;    ///< Near a surface that was seen.
  std::size_t blocks_seen_free = 0;  ///< Others that were looked through.
  std::size_t blocks_allocated = 0;  ///< New.
  std::size_t blocks_refused = 0;    ///< Would be new, but the frame alone fills max_blocks.
  std::size_t blocks_removed = 0;    ///< Empty after carving.
  std::size_t blocks_finalised = 0;  ///< Left the window; now final mesh.
};

/// Sizes of the map.
struct MapSize {
  std::size_t blocks = 0;         ///< In memory.
  std::size_t vertices = 0;       ///< Final ones included.
  std::size_t faces = 0;          ///< Likewise.
  std::size_t final_faces = 0;    ///< Of blocks that left the window.
  std::size_t dropped_faces = 0;  ///< Since the start: superseded, see drop().
};

/// Fuses depth and label images with known poses into a truncated signed distance function and
/// keeps its zero level as a triangle mesh.
///
/// Voxels lie in blocks of 8^3 that are hashed by their position (Niessner et al., "Real-time 3D
/// Reconstruction at Scale using Voxel Hashing", 2013), allocated where a depth image shows
/// surface. Every voxel of these blocks and, for carving, of the other blocks in view is projected
/// into the depth image (Curless and Levoy, "A Volumetric Method for Building Complex Models from
/// Range Images", 1996). Voxels near the surface also take part in the vote of labels (see
/// VoxelLabels), Bayes' rule as in Rosinol et al., "Kimera: an Open-Source Library for Real-Time
/// Metric-Semantic Localization and Mapping", 2020.
///
/// The mesh has no cracks: blocks share the vertices on their borders. Only blocks that changed are
/// meshed again; a vertex is the crossing of one grid edge and keeps its identity while the surface
/// crosses that edge. Blocks that leave the window (see SemanticMappingConfig) become final mesh
/// that never changes again, but where it still hangs together with blocks in the window.
///
/// Memory: max_blocks bounds the voxels; the mesh grows with the surface seen, and as often as it
/// was seen anew but for what drop() is told.
///
/// Deterministic: the same calls give the same mesh, bit by bit, however many threads OpenCV's pool
/// has (cv::setNumThreads(); images and blocks are worked on in parallel). Not thread-safe.
class SemanticMapper {
 public:
  /// `camera` takes the depth and label images; its T_body_cam is not used. Labels that `palette`
  /// lacks count as unknown. Throws ConfigError if `config` is out of bounds and
  /// std::invalid_argument for a camera without pixels or focal length.
  SemanticMapper(const SemanticMappingConfig& config, const Camera& camera,
                 const LabelPalette& palette = {});
  ~SemanticMapper();
  SemanticMapper(SemanticMapper&&) noexcept;
  SemanticMapper& operator=(SemanticMapper&&) noexcept;

  /// Fuses one depth image and, unless null, its labels. `T_odom_cam` is the camera's pose,
  /// `keyframe` the robot's last keyframe at that time. Throws std::invalid_argument if `keyframe`
  /// is before that of an earlier call.
  IntegrationReport integrate(const DepthImage& depth, const LabelImage* labels,
                              const SE3& T_odom_cam, KeyframeIndex keyframe);

  /// Meshes again what changed since the last call. After every frame, or less often: a vertex that
  /// came up in between has the first of these frames' keyframe as its first.
  MeshUpdateReport update_mesh();

  /// Drops final surface that another visit has mapped better (see IncrementalMesh::drop()): its
  /// labels vote on, its faces are gone for good. Surface in the window stays.
  SurfaceDrop drop(const SupersededSurface& superseded);

  /// The mesh as of the last update_mesh(), final and active parts together, in the odometry frame,
  /// with labels if any frame had some; without colours (see LabelledMesh::colour_by()). Every
  /// vertex is part of a face. Time and memory proportional to the mesh.
  [[nodiscard]] MapMesh mesh() const;

  [[nodiscard]] MapSize size() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// State of a robot's map, for status lines and tables.
struct MappingProgress {
  std::uint64_t integrated = 0;      ///< Frames.
  std::uint64_t wrong_size = 0;      ///< Skipped: depth not of the camera's size.
  std::uint64_t bad_pose = 0;        ///< Skipped: pose not finite or not a rotation.
  std::uint64_t too_late = 0;        ///< Skipped: newer ones came while the mapper was busy.
  std::uint64_t unlabelled = 0;      ///< Integrated without labels.
  std::uint64_t labels_outside = 0;  ///< Pixels whose label the palette lacks.
  std::uint64_t blocks_refused = 0;  ///< For want of semantic_mapping.max_blocks.
  MapSize size = {};
};

}  // namespace km
