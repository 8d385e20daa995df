#pragma once

#include <array>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "modules/core/ids.hpp"
#include "modules/core/label_palette.hpp"
#include "modules/mesh/labelled_mesh.hpp"

namespace km {

/// Identity of a chunk: the newest one with a key replaces all before.
struct MeshChunkKey {
  RobotId robot = 0;
  std::array<std::int32_t, 3> cell = {0, 0, 0};
  std::uint16_t part = 0;
  auto operator<=>(const MeshChunkKey&) const = default;
};

/// A piece of a robot's mesh that stands for itself: a chunk has all vertices of its faces. Their
/// positions are rounded to a grid that all chunks share, so that a vertex which several chunks
/// have is at the same place in all: position = step_m * (origin + offset).
///
/// A chunk without faces says that the piece with its key is no more.
struct MeshChunk {
  using Triple = std::array<std::uint16_t, 3>;

  MeshChunkKey key;
  std::uint64_t boot = 0;  ///< Process of the robot that sent it; of received chunks only.
  RobotId anchor = 0;      ///< Robot whose odometry frame is `world`.
  float step_m = 0.001F;
  std::array<std::int32_t, 3> origin = {0, 0, 0};  ///< [step_m] in `world`.
  std::vector<Triple> offsets = {};                ///< Of each vertex [step_m].
  std::vector<LabelId> labels = {};                ///< Of each vertex, or empty.
  std::vector<Triple> faces = {};                  ///< Counter-clockwise seen from free space.

  [[nodiscard]] bool empty() const { return faces.empty(); }
  bool operator==(const MeshChunk&) const = default;
};

/// No chunk is larger than this on the wire, everything included.
inline constexpr std::size_t kMaxChunkBytes = 32000;

/// Upper bound on the bytes of a chunk on the wire.
[[nodiscard]] constexpr std::size_t wire_bytes(std::size_t vertices, std::size_t faces,
                                               bool labelled) {
  constexpr std::size_t kFixed = 96;  // envelope, cell, part, grid, origin, three lengths, padding
  return kFixed + (labelled ? 7 : 6) * vertices + 6 * faces;
}
[[nodiscard]] inline std::size_t wire_bytes(const MeshChunk& chunk) {
  return wire_bytes(chunk.offsets.size(), chunk.faces.size(), !chunk.labels.empty());
}

/// Why this cannot be a chunk that split_mesh() makes (a string literal), or null: what has come
/// from somewhere else is used only after this.
[[nodiscard]] const char* fault_of(const MeshChunk& chunk);

/// The grid that a mesh is cut along, and the one its positions are rounded to.
struct ChunkGrid {
  double cell_m = 2.0;
  double step_m = 0.001;
};

/// A mesh in pieces.
struct MeshPieces {
  std::vector<MeshChunk> chunks;    ///< Keys ascending, none empty.
  std::size_t oversized_faces = 0;  ///< Left out: longer than the range of offsets, 65 535 steps.
};

/// Cuts a mesh in `world` into chunks of at most kMaxChunkBytes. Positions are off by up to half a
/// step per axis; colours and vertices without faces are left out. A face belongs to the cell of
/// its centroid. A piece of mesh that did not change gives the same chunk as long as its vertices
/// are in the same order; the order of faces does not matter. Throws std::invalid_argument for a
/// grid that is not positive, cells that are no longer than a step, a vertex that is not finite or
/// beyond 2^30 steps, and a face that names a vertex which does not exist. Linear but for sorting
/// the faces of a cell.
[[nodiscard]] MeshPieces split_mesh(const LabelledMesh& mesh, RobotId robot, RobotId anchor,
                                    const ChunkGrid& grid);

/// One mesh of the chunks, which must have one step_m: vertices at the same place with the same
/// label become one, faces that rounding has left without area go. Labels where any chunk has some.
[[nodiscard]] LabelledMesh assemble_mesh(std::span<const MeshChunk* const> chunks);

/// True if a viewer would see a difference: other faces, labels or frame, or a vertex that moved by
/// more than `min_move_m` along an axis.
[[nodiscard]] bool differ(const MeshChunk& a, const MeshChunk& b, double min_move_m);

}  // namespace km
