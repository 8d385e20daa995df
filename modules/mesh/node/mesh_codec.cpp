#include "modules/mesh/node/mesh_codec.hpp"

#include <algorithm>
#include <span>
#include <utility>

#include "modules/mesh/chunk_packing.hpp"

namespace km {
namespace {

std::vector<km_wire_MeshKeyframe> to_wire(const std::vector<MeshKeyframe>& keyframes) {
  std::vector<km_wire_MeshKeyframe> wire;
  for (const auto& [index, T] : keyframes)
    wire.push_back(
        {.keyframe = index, .t = {T.t[0], T.t[1], T.t[2]}, .q = {T.q[0], T.q[1], T.q[2], T.q[3]}});
  return wire;
}

std::vector<MeshKeyframe> from_wire(std::span<const km_wire_MeshKeyframe> wire) {
  std::vector<MeshKeyframe> keyframes;
  for (const auto& [index, t, q] : wire)
    keyframes.push_back({index, {{t[0], t[1], t[2]}, {q[0], q[1], q[2], q[3]}}});
  return keyframes;
}

}  // namespace

MessageKey Codec<MeshChunk>::key_of(const MeshChunk& chunk) {
  const auto number = [](std::int32_t c) { return static_cast<std::uint32_t>(c); };
  const auto& [x, y, z] = chunk.key.cell;
  return message_key({number(x), number(y), number(z), chunk.key.part});
}

Codec<MeshChunk>::Encoded Codec<MeshChunk>::encode(const MeshChunk& chunk) {
  Encoded encoded;
  encoded.content = packed(chunk);
  Wire& wire = encoded.wire;
  wire.cell = {.x = chunk.key.cell[0], .y = chunk.key.cell[1], .z = chunk.key.cell[2]};
  wire.part = chunk.key.part;
  wire.anchor = chunk.anchor;
  wire.step_m = chunk.step_m;
  wire.voxel_m = chunk.voxel_m;
  wire.origin = {.x = chunk.origin[0], .y = chunk.origin[1], .z = chunk.origin[2]};
  wire.vertices = static_cast<std::uint16_t>(chunk.offsets.size());
  wire.faces = static_cast<std::uint16_t>(chunk.faces.size());
  wire.is_labelled = !chunk.labels.empty();
  wire.is_coloured = !chunk.colors.empty();
  encoded.keyframes = to_wire(chunk.keyframes);
  borrow(wire.keyframes, encoded.keyframes);
  borrow(wire.content, encoded.content);
  return encoded;
}

Decoded<MeshChunk> Codec<MeshChunk>::decode(const Wire& wire, const TeamPeer& writer) {
  using Result = Decoded<MeshChunk>;
  const auto content = elements_of(wire.content, kMaxBytes);
  const auto keyframes = elements_of(wire.keyframes, kMaxChunkKeyframes);
  if (!content || !keyframes) return Result::refuse("elements are missing or too many");
  MeshChunk chunk{.key = {writer.robot, {wire.cell.x, wire.cell.y, wire.cell.z}, wire.part},
                  .boot = writer.boot,
                  .anchor = wire.anchor,
                  .step_m = wire.step_m,
                  .voxel_m = wire.voxel_m,
                  .origin = {wire.origin.x, wire.origin.y, wire.origin.z},
                  .keyframes = from_wire(*keyframes)};
  const ChunkCounts counts{.vertices = wire.vertices,
                           .faces = wire.faces,
                           .labelled = wire.is_labelled,
                           .coloured = wire.is_coloured,
                           .seen = !chunk.keyframes.empty()};
  if (!unpack(*content, counts, chunk)) return Result::refuse("a chunk that cannot be unpacked");
  if (const char* fault = fault_of(chunk)) return Result::refuse(fault);
  return Result::accept(std::move(chunk));
}

Codec<MeshPoses>::Encoded Codec<MeshPoses>::encode(const MeshPoses& poses) {
  Encoded encoded;
  encoded.keyframes = to_wire(poses.keyframes);
  encoded.wire.anchor = poses.anchor;
  borrow(encoded.wire.keyframes, encoded.keyframes);
  return encoded;
}

Decoded<MeshPoses> Codec<MeshPoses>::decode(const Wire& wire, const TeamPeer& writer) {
  using Result = Decoded<MeshPoses>;
  const auto keyframes = elements_of(wire.keyframes, kMaxMeshKeyframes);
  if (!keyframes) return Result::refuse("elements are missing or too many");
  MeshPoses poses{.robot = writer.robot,
                  .boot = writer.boot,
                  .anchor = wire.anchor,
                  .keyframes = from_wire(*keyframes)};
  if (const char* fault = fault_of(poses.keyframes)) return Result::refuse(fault);
  return Result::accept(std::move(poses));
}

}  // namespace km
