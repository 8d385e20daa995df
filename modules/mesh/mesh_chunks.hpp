#pragma once

#include <array>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "modules/core/ids.hpp"
#include "modules/core/keyframe.hpp"
#include "modules/core/label_palette.hpp"
#include "modules/core/mesh_cells.hpp"
#include "modules/mesh/labelled_mesh.hpp"

namespace km {

/// Identity of a chunk: the newest chunk with a key replaces all earlier ones.
struct MeshChunkKey {
  RobotId robot = 0;
  MeshCells::Cell cell = {0, 0, 0};
  std::uint16_t part = 0;
  auto operator<=>(const MeshChunkKey&) const = default;
};

/// A keyframe from which a part of a mesh was seen, and its pose when this part was placed in
/// `world`. Relative to the keyframe, the part stays where it is when poses are optimised again.
struct SurfaceKeyframe {
  OdometryPose odometry;
  SE3 T_world_kf = SE3::Identity();
  bool operator==(const SurfaceKeyframe& other) const;
};

/// A self-contained part of a robot's mesh: a chunk has all vertices of its faces. Their positions
/// are rounded to a grid that all chunks share, so that a vertex has the same position in all
/// chunks that contain it: position = step_m * (origin + offset).
///
/// A chunk without faces means that the mesh no longer has a chunk with its key.
struct MeshChunk {
  using Triple = std::array<std::uint16_t, 3>;

  MeshChunkKey key;
  std::uint64_t boot = 0;  ///< Boot id of the sender; only set in received chunks.
  RobotId anchor = 0;      ///< Robot whose odometry frame is `world`.
  float step_m = 0.001F;
  std::array<std::int32_t, 3> origin = {0, 0, 0};  ///< [step_m] in `world`.
  std::vector<Triple> offsets = {};                ///< Offset of each vertex [step_m].
  std::vector<LabelId> labels = {};                ///< Label of each vertex, or empty.
  std::vector<Triple> faces = {};                  ///< Counter-clockwise seen from free space.
  /// Keyframe in the middle of those that saw the chunk; absent without `map.surface_ties`.
  std::optional<SurfaceKeyframe> keyframe = {};

  [[nodiscard]] bool empty() const { return faces.empty(); }
  bool operator==(const MeshChunk&) const = default;
};

/// Largest size of a chunk on the wire, with its envelope.
inline constexpr std::size_t kMaxChunkBytes = 32000;

/// Bytes of MeshChunk::keyframe on the wire, with padding.
inline constexpr std::size_t kSurfaceKeyframeBytes = 296;

/// Upper bound on the bytes of a chunk on the wire, without a keyframe.
[[nodiscard]] constexpr std::size_t wire_bytes(std::size_t vertices, std::size_t faces,
                                               bool labelled) {
  constexpr std::size_t kFixed = 104;  // bytes of all fields that are not sequences, and padding
  return kFixed + (labelled ? 7 : 6) * vertices + 6 * faces;
}
[[nodiscard]] inline std::size_t wire_bytes(const MeshChunk& chunk) {
  return wire_bytes(chunk.offsets.size(), chunk.faces.size(), !chunk.labels.empty()) +
         (chunk.keyframe ? kSurfaceKeyframeBytes : 0);
}

/// The reason why `chunk` cannot be from split_mesh() (a string literal), or null. Received chunks
/// are used only after this check.
[[nodiscard]] const char* fault_of(const MeshChunk& chunk);

/// The grid of cells by which a mesh is split, and the grid to which positions are rounded.
struct ChunkGrid {
  double cell_m = 2.0;
  double step_m = 0.001;
};

/// A mesh split into chunks.
struct SplitMesh {
  std::vector<MeshChunk> chunks;  ///< Keys ascending, none empty.
  /// Dropped faces: longer along an axis than a third of the range of offsets, 21 845 steps.
  std::size_t oversized_faces = 0;
};

/// Splits a mesh in `world` into chunks of at most kMaxChunkBytes, also with a keyframe. Positions
/// err by up to half a step per axis. Colours, and vertices without faces, are dropped. A face
/// belongs to the cell of its centroid. An unchanged part of the mesh gives the same chunk if its
/// vertices are in the same order; the order of faces does not matter.
///
/// Throws std::invalid_argument for a grid that is not positive and for cells that are no longer
/// than a step. Also throws it for a vertex that is not finite or beyond 2^30 steps, and for a face
/// with a vertex that does not exist. Linear except for sorting the faces of a cell.
[[nodiscard]] SplitMesh split_mesh(const LabelledMesh& mesh, RobotId robot, RobotId anchor,
                                   const ChunkGrid& grid);

/// The cells that contain the centroid of a face, ascending. Faces that are not finite, or farther
/// away than 2^30 cells, are left out. Precondition: corners exist.
[[nodiscard]] std::vector<MeshCells::Cell> occupied_cells(const LabelledMesh& mesh, double cell_m);

/// One mesh of the chunks, which must have one step_m. Vertices with the same position and label
/// are merged, and faces that rounding has left without area are removed. The mesh has labels if
/// any chunk has labels.
[[nodiscard]] LabelledMesh assemble_mesh(std::span<const MeshChunk* const> chunks);

/// True if a viewer would show a difference: other faces, labels or frame, or a vertex that moved
/// by more than `min_move_m` along an axis.
[[nodiscard]] bool differ(const MeshChunk& a, const MeshChunk& b, double min_move_m);

}  // namespace km
