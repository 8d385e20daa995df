#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include "modules/core/camera/camera.hpp"
#include "modules/core/camera/color_image.hpp"
#include "modules/core/camera/frame.hpp"
#include "modules/core/geometry/geometry.hpp"
#include "modules/core/ids.hpp"
#include "modules/core/map/label_palette.hpp"
#include "modules/mesh/map_mesh.hpp"
#include "modules/semantic_mapping/incremental_mesh.hpp"
#include "modules/semantic_mapping/semantic_mapping_config.hpp"

namespace km {

/// Result for one frame.
enum class IntegrationStatus {
  kIntegrated,
  kDepthSizeDiffers,  ///< The depth image has another size than the camera; the frame is skipped.
  kPoseUnusable,      ///< The pose is not finite or not rigid; the frame is skipped.
};

/// Counts of one call of integrate(). All but status are zero for a skipped frame.
struct [[nodiscard]] IntegrationReport {
  IntegrationStatus status = IntegrationStatus::kIntegrated;
  std::size_t off_palette_pixels = 0;  ///< Pixels whose label the palette lacks: unknown.
  bool label_size_differs = false;     ///< Integrated without the labels, whose size is wrong.
  std::size_t blocks_refused = 0;  ///< Requests for new blocks that were refused, see NearBlocks.
};

/// Sizes of the map.
struct MapSize {
  std::size_t blocks = 0;         ///< Blocks in memory.
  std::size_t vertices = 0;       ///< Vertices, including final ones.
  std::size_t faces = 0;          ///< Faces, including final ones.
  std::size_t final_faces = 0;    ///< Faces of blocks that left the window.
  std::size_t dropped_faces = 0;  ///< Superseded faces dropped since the start, see drop().
};

/// Fuses depth and label images with known poses into a truncated signed distance function and
/// keeps its zero level as a triangle mesh.
///
/// Voxels are in blocks of 8^3 that are hashed by their position (Niessner et al., "Real-time 3D
/// Reconstruction at Scale using Voxel Hashing", 2013). Blocks are allocated where a depth image
/// shows surface, with voxels of a size that fits the error of its depth: there is a map for each
/// band of depths. Surface that a map of smaller voxels knows is not meshed from larger ones. Every
/// voxel of these blocks and, for carving, of the other blocks in view is projected into the depth
/// image (Curless and Levoy, "A Volumetric Method for Building Complex Models from Range Images",
/// 1996). Voxels near the surface also receive votes on labels (see VoxelLabels) by Bayes' rule, as
/// in Rosinol et al., "Kimera: an Open-Source Library for Real-Time Metric-Semantic Localization
/// and Mapping", 2020.
///
/// The mesh has no cracks: blocks share the vertices on their borders. Only changed blocks are
/// meshed again. A vertex is the crossing of one grid edge, and keeps its identity while the
/// surface crosses that edge. Blocks that leave the window (see SemanticMappingConfig) become final
/// mesh. It does not change any more, except for vertices shared with blocks in the window.
///
/// Memory: max_blocks bounds the voxels. The mesh grows with every visit of a surface, except for
/// the copies that drop() removes.
///
/// Deterministic: equal calls give the same mesh, bit by bit, for any number of threads of OpenCV's
/// pool (cv::setNumThreads(); images and blocks are processed in parallel). Not thread-safe.
class SemanticMapper {
 public:
  /// `camera` takes the depth and label images; its T_body_cam is not used. Labels that `palette`
  /// lacks count as unknown. Throws ConfigError if `config` is out of bounds, std::invalid_argument
  /// for one without voxel_size_m (see fitting_voxel_m()) and for a camera without pixels or focal
  /// length.
  SemanticMapper(const SemanticMappingConfig& config, const Camera& camera,
                 const LabelPalette& palette = {});
  ~SemanticMapper();
  SemanticMapper(SemanticMapper&&) noexcept;
  SemanticMapper& operator=(SemanticMapper&&) noexcept;

  /// Fuses one depth image and, unless null, its labels and the colours of the camera's image.
  /// Colours of another size do not count. `T_odom_cam` is the camera's pose, `keyframe` the
  /// robot's last keyframe at that time. Throws std::invalid_argument if `keyframe` is before that
  /// of an earlier call.
  IntegrationReport integrate(const DepthImage& depth, const LabelImage* labels,
                              const SE3& T_odom_cam, KeyframeIndex keyframe,
                              const ColorImage* color = nullptr);

  /// Meshes the blocks that changed since the last call. Call it after every frame or less often. A
  /// new vertex gets the keyframe of the first frame since the last call as its first one. Returns
  /// the number of blocks that were meshed.
  std::size_t update_mesh();

  /// Drops final surface that another visit has mapped better (see IncrementalMesh::drop()). Its
  /// votes on labels are kept, its faces are permanently removed. Surface in the window stays.
  SurfaceDrop drop(const SupersededSurface& superseded);

  /// The mesh as of the last update_mesh(), final and active parts together, in the odometry frame.
  /// It has labels, or colours, if any frame had some. Every
  /// vertex is part of a face. Time and memory proportional to the mesh.
  [[nodiscard]] MapMesh mesh() const;

  [[nodiscard]] MapSize size() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// State of a robot's map, for status lines and tables.
struct MappingProgress {
  std::uint64_t integrated = 0;  ///< Integrated frames.
  std::uint64_t wrong_size = 0;  ///< Skipped frames: depth of another size than the camera.
  std::uint64_t bad_pose = 0;    ///< Skipped frames: pose not finite or not rigid.
  std::uint64_t too_late = 0;    ///< Skipped frames: newer ones arrived while the mapper was busy.
  std::uint64_t unlabelled = 0;  ///< Frames integrated without labels.
  std::uint64_t off_palette_pixels = 0;  ///< Pixels whose label the palette lacks.
  std::uint64_t blocks_refused = 0;      ///< Sum of IntegrationReport::blocks_refused.
  MapSize size = {};
};

}  // namespace km
