#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "modules/mesh/mesh_chunks.hpp"

namespace km {

/// The chunk with its vertices along rows of small cells, and its faces in the order of their
/// vertices. Neighbours in space are then mostly neighbours in the lists, so that packed() needs
/// fewer bytes.
[[nodiscard]] MeshChunk sorted_in_space(const MeshChunk& chunk);

/// Numbers of elements of a packed chunk.
struct ChunkCounts {
  std::size_t vertices = 0;
  std::size_t faces = 0;
  bool labelled = false;  ///< With MeshChunk::labels.
  bool coloured = false;  ///< With MeshChunk::colors.
  bool seen = false;      ///< With MeshChunk::views.
};

/// Offsets, faces, labels, colours and views of a chunk, compressed by Zstandard. Numbers are
/// stated as differences from the ones before them, all low bytes before all high bytes.
[[nodiscard]] std::vector<std::uint8_t> packed(const MeshChunk& chunk);

/// Sets offsets, faces, labels, colours and views of `chunk` to those of packed(). False if the
/// bytes are not those of a chunk with these numbers of elements, or if it has more than
/// kMaxChunkBytes. Memory and time are bounded by kMaxChunkBytes.
[[nodiscard]] bool unpack(std::span<const std::uint8_t> bytes, const ChunkCounts& counts,
                          MeshChunk& chunk);

/// Upper bound on the bytes of a chunk on the wire, with its envelope. Packs the chunk.
[[nodiscard]] std::size_t wire_bytes(const MeshChunk& chunk);

}  // namespace km
