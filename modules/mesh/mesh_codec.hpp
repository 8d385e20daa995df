#pragma once

#include <mesh.h>

#include <cstdint>
#include <vector>

#include "modules/mesh/mesh_chunks.hpp"
#include "runtime/dds/codec.hpp"

namespace km {

/// A robot sends its own mesh only. Refused are chunks above kMaxChunkBytes, offsets, labels and
/// faces that do not fit each other, faces that name vertices which do not exist, and positions
/// that are not finite or absurdly far away.
template <>
struct Codec<MeshChunk> {
  using Wire = km_wire_MeshChunk;
  static constexpr const char* kTopic = "mesh_chunks";
  static constexpr std::uint16_t kVersion = 1;
  static constexpr std::size_t kMaxBytes = kMaxChunkBytes;
  static const dds_topic_descriptor_t& descriptor() { return km_wire_MeshChunk_desc; }

  struct Encoded {
    Wire wire{};
    std::vector<std::uint16_t> offsets, faces;
    std::vector<std::uint8_t> labels;
  };
  static MessageKey key_of(const MeshChunk& chunk);
  static Encoded encode(const MeshChunk& chunk);
  static Decoded<MeshChunk> decode(const Wire& wire, const TeamPeer& writer);
};

}  // namespace km
