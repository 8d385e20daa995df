#pragma once

#include <array>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "modules/core/data/keyframe.hpp"
#include "modules/core/ids.hpp"
#include "modules/core/map/label_palette.hpp"
#include "modules/core/map/mesh_cells.hpp"
#include "modules/mesh/labelled_mesh.hpp"
#include "modules/mesh/mesh_origin.hpp"
#include "modules/mesh/mesh_poses.hpp"

namespace km {

/// Identity of a chunk: the newest chunk with a key replaces all earlier ones.
struct MeshChunkKey {
  RobotId robot = 0;
  MeshCells::Cell cell = {0, 0, 0};
  std::uint16_t part = 0;
  auto operator<=>(const MeshChunkKey&) const = default;
};

/// A self-contained part of a robot's mesh: a chunk has all vertices of its faces. Their positions
/// are rounded to a grid that all chunks share, so that a vertex has the same position in all
/// chunks that contain it: position = step_m * (origin + offset).
///
/// A chunk states the keyframes that move it, with their poses when it was sent. Receivers place it
/// with the present poses of these keyframes (see place()), so that a correction of the trajectory
/// does not change chunks.
///
/// A chunk without faces means that the mesh no longer has a chunk with its key.
struct MeshChunk {
  using Triple = std::array<std::uint16_t, 3>;
  /// A time, as kViewsPerKeyframe * i + j: the share j / kViewsPerKeyframe of the way from
  /// keyframes[i] to the next one of `keyframes`.
  using View = std::uint8_t;

  MeshChunkKey key;
  std::uint64_t boot = 0;  ///< Boot id of the sender; only set in received chunks.
  RobotId anchor = 0;      ///< Robot whose odometry frame is `world`.
  float step_m = 0.001F;
  float voxel_m = 0.0F;  ///< Side of the voxels the surface was made from; 0: unknown.
  std::array<std::int32_t, 3> origin = {0, 0, 0};  ///< [step_m] in `world`.
  std::vector<Triple> offsets = {};                ///< Offset of each vertex [step_m].
  std::vector<LabelId> labels = {};                ///< Label of each vertex, or empty.
  /// Colour of each vertex, or empty: 5 bits of red, 6 of green, 5 of blue, from the highest on.
  std::vector<std::uint16_t> colors = {};
  std::vector<Triple> faces = {};            ///< Counter-clockwise seen from free space.
  std::vector<MeshKeyframe> keyframes = {};  ///< Ascending; empty: the chunk never moves.
  /// First and last view of each vertex; empty without `keyframes`.
  std::vector<std::array<View, 2>> views = {};

  [[nodiscard]] bool empty() const { return faces.empty(); }
  bool operator==(const MeshChunk&) const = default;
};

/// Largest plain_bytes() of a chunk. On the wire it is packed (chunk_packing.hpp).
inline constexpr std::size_t kMaxChunkBytes = 32000;

/// Number of Views from one keyframe of a chunk to the next.
inline constexpr std::size_t kViewsPerKeyframe = 4;

/// Largest number of MeshChunk::keyframes, so that a View has one byte.
inline constexpr std::size_t kMaxChunkKeyframes = 256 / kViewsPerKeyframe;

/// Bytes of all fields of a chunk that are not sequences, with its envelope and padding: an upper
/// bound.
inline constexpr std::size_t kChunkFixedBytes = 116;

/// Bytes of a chunk that is not packed, without keyframes.
[[nodiscard]] constexpr std::size_t plain_bytes(std::size_t vertices, std::size_t faces,
                                                bool labelled, bool coloured) {
  return kChunkFixedBytes + (6 + (labelled ? 1 : 0) + (coloured ? 3 : 0)) * vertices + 6 * faces;
}
[[nodiscard]] inline std::size_t plain_bytes(const MeshChunk& chunk) {
  return plain_bytes(chunk.offsets.size(), chunk.faces.size(), !chunk.labels.empty(),
                     !chunk.colors.empty()) +
         kMeshKeyframeBytes * chunk.keyframes.size() + 2 * chunk.views.size();
}

/// The reason why `chunk` cannot be from split_mesh() (a string literal), or null. Received chunks
/// are used only after this check.
[[nodiscard]] const char* fault_of(const MeshChunk& chunk);

/// A colour as in MeshChunk::colors, and the colour that it states.
[[nodiscard]] std::uint16_t packed_color(const LabelledMesh::Color& color);
[[nodiscard]] LabelledMesh::Color unpacked_color(std::uint16_t packed);

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

/// Splits a mesh in `world` into chunks of at most kMaxChunkBytes. Positions
/// err by up to half a step per axis. Vertices without faces are dropped. A face
/// belongs to the cell of its centroid. An unchanged part of the mesh gives the same chunk if its
/// vertices are in the same order; the order of faces does not matter.
///
/// With an `origin`, chunks have the keyframes that move them: every mesh_keyframe_step()-th one of
/// the trajectory, or less if a chunk had more than kMaxChunkKeyframes of them. Cells are then
/// those of the positions before the deformation, so that a correction moves no face to another
/// cell. Surface from voxels of different sizes is in different chunks.
///
/// Throws std::invalid_argument for a grid that is not positive and for cells that are no longer
/// than a step. Also throws it for a vertex that is not finite or beyond 2^30 steps, and for a face
/// with a vertex that does not exist. Also for an origin of another mesh, and as RoundedPose::of().
/// Linear except for sorting the faces of a cell.
[[nodiscard]] SplitMesh split_mesh(const LabelledMesh& mesh, RobotId robot, RobotId anchor,
                                   const ChunkGrid& grid, const MeshOrigin* origin = nullptr);

/// The cells that contain the centroid of a face, ascending. Faces that are not finite, or farther
/// away than 2^30 cells, are left out. Precondition: corners exist.
[[nodiscard]] std::vector<MeshCells::Cell> occupied_cells(const LabelledMesh& mesh, double cell_m);

}  // namespace km
