#pragma once

#include <mesh.h>

#include <cstdint>
#include <vector>

#include "modules/mesh/mesh_chunks.hpp"
#include "modules/mesh/mesh_poses.hpp"
#include "runtime/dds/codec.hpp"

namespace km {

/// A robot sends only its own mesh. A chunk is refused if it cannot be unpacked, if it is larger
/// than kMaxChunkBytes, or if a face names a missing vertex. It is also refused if positions are
/// not finite or too far away, and for keyframes that fault_of() refuses.
template <>
struct Codec<MeshChunk> : WireFormat<km_wire_PackedMeshChunk, km_wire_PackedMeshChunk_desc> {
  static constexpr const char* kTopic = "packed_mesh_chunks";
  static constexpr std::size_t kMaxBytes = kMaxChunkBytes + 256;  // incompressible

  struct Encoded {
    Wire wire{};
    std::vector<std::uint8_t> content;
    std::vector<km_wire_MeshKeyframe> keyframes;
  };
  static MessageKey key_of(const MeshChunk& chunk);
  static Encoded encode(const MeshChunk& chunk);
  static Decoded<MeshChunk> decode(const Wire& wire, const TeamPeer& writer);
};

/// A robot states only its own poses. A message is refused if it has more than kMaxMeshKeyframes
/// poses, if their indices do not ascend, or if a rotation is none.
template <>
struct Codec<MeshPoses> : WireFormat<km_wire_MeshPoses, km_wire_MeshPoses_desc> {
  static constexpr const char* kTopic = "mesh_poses";
  static constexpr std::size_t kMaxBytes = 128 + kMeshKeyframeBytes * kMaxMeshKeyframes;

  struct Encoded {
    Wire wire{};
    std::vector<km_wire_MeshKeyframe> keyframes;
  };
  static MessageKey key_of(const MeshPoses& /*poses*/) { return message_key({}); }
  static Encoded encode(const MeshPoses& poses);
  static Decoded<MeshPoses> decode(const Wire& wire, const TeamPeer& writer);
};

}  // namespace km
