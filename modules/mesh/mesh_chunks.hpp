#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "modules/mesh/labelled_mesh.hpp"
#include "modules/mesh/mesh_chunk.hpp"

namespace km {

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
