#pragma once

#include <mesh.h>

#include <cstdint>
#include <vector>

#include "modules/mesh/mesh_chunks.hpp"
#include "runtime/dds/codec.hpp"

namespace km {

/// A robot sends only its own mesh. A chunk is refused if it is larger than kMaxChunkBytes, if its
/// offsets, labels and faces do not match, or if a face names a missing vertex. It is also refused
/// if positions are not finite or too far away, and for a keyframe that is not one of its robot.
template <>
struct Codec<MeshChunk> {
  using Wire = km_wire_MeshChunk;
  static constexpr const char* kTopic = "mesh_chunks";
  static constexpr std::uint16_t kVersion = 2;
  static constexpr std::size_t kMaxBytes = kMaxChunkBytes;
  static const dds_topic_descriptor_t& descriptor() { return km_wire_MeshChunk_desc; }

  struct Encoded {
    Wire wire{};
    std::vector<std::uint16_t> offsets, faces;
    std::vector<std::uint8_t> labels;
    std::vector<km_wire_SurfaceKeyframe> keyframe;
  };
  static MessageKey key_of(const MeshChunk& chunk);
  static Encoded encode(const MeshChunk& chunk);
  static Decoded<MeshChunk> decode(const Wire& wire, const TeamPeer& writer);
};

}  // namespace km
