#include "modules/mesh/node/mesh_codec.hpp"

#include <utility>

#include "runtime/dds/codec.hpp"
#include "runtime/dds/wire_pose.hpp"

namespace km {
namespace {

using Triple = MeshChunk::Triple;

std::vector<std::uint16_t> flat(const std::vector<Triple>& triples) {
  std::vector<std::uint16_t> numbers;
  numbers.reserve(3 * triples.size());
  for (const Triple& triple : triples) numbers.insert(numbers.end(), triple.begin(), triple.end());
  return numbers;
}

// Precondition: the number of elements is a multiple of three.
std::vector<Triple> triples(std::span<const std::uint16_t> numbers) {
  std::vector<Triple> result;
  result.reserve(numbers.size() / 3);
  for (std::size_t i = 0; i < numbers.size(); i += 3)
    result.push_back({numbers[i], numbers[i + 1], numbers[i + 2]});
  return result;
}

}  // namespace

MessageKey Codec<MeshChunk>::key_of(const MeshChunk& chunk) {
  const auto number = [](std::int32_t c) { return static_cast<std::uint32_t>(c); };
  const auto& [x, y, z] = chunk.key.cell;
  return message_key({number(x), number(y), number(z), chunk.key.part});
}

Codec<MeshChunk>::Encoded Codec<MeshChunk>::encode(const MeshChunk& chunk) {
  Encoded encoded;
  encoded.offsets = flat(chunk.offsets);
  encoded.faces = flat(chunk.faces);
  encoded.labels = chunk.labels;
  Wire& wire = encoded.wire;
  wire.cell = {.x = chunk.key.cell[0], .y = chunk.key.cell[1], .z = chunk.key.cell[2]};
  wire.part = chunk.key.part;
  wire.anchor = chunk.anchor;
  wire.step_m = chunk.step_m;
  wire.origin = {.x = chunk.origin[0], .y = chunk.origin[1], .z = chunk.origin[2]};
  if (chunk.keyframe)
    encoded.keyframe.push_back({.odometry = to_wire(chunk.keyframe->odometry),
                                .T_world_kf = to_wire(chunk.keyframe->T_world_kf)});
  borrow(wire.keyframe, encoded.keyframe);
  borrow(wire.offsets, encoded.offsets);
  borrow(wire.labels, encoded.labels);
  borrow(wire.faces, encoded.faces);
  return encoded;
}

Decoded<MeshChunk> Codec<MeshChunk>::decode(const Wire& wire, const TeamPeer& writer) {
  using Result = Decoded<MeshChunk>;
  const auto offsets = elements_of(wire.offsets, kMaxChunkBytes);
  const auto labels = elements_of(wire.labels, kMaxChunkBytes);
  const auto faces = elements_of(wire.faces, kMaxChunkBytes);
  const auto keyframes = elements_of(wire.keyframe, 1);
  if (!offsets || !labels || !faces || !keyframes)
    return Result::refuse("elements are missing or too many");
  if (offsets->size() % 3 != 0 || faces->size() % 3 != 0)
    return Result::refuse("offsets or faces are not triples");
  MeshChunk chunk{.key = {writer.robot, {wire.cell.x, wire.cell.y, wire.cell.z}, wire.part},
                  .boot = writer.boot,
                  .anchor = wire.anchor,
                  .step_m = wire.step_m,
                  .origin = {wire.origin.x, wire.origin.y, wire.origin.z},
                  .offsets = triples(*offsets),
                  .labels = {labels->begin(), labels->end()},
                  .faces = triples(*faces)};
  if (!keyframes->empty()) {
    const auto odometry = from_wire(keyframes->front().odometry);
    const auto T_world_kf = from_wire(keyframes->front().T_world_kf);
    if (!odometry || !T_world_kf) return Result::refuse("a keyframe without a pose");
    chunk.keyframe = {*odometry, *T_world_kf};
  }
  if (const char* fault = fault_of(chunk)) return Result::refuse(fault);
  return Result::accept(std::move(chunk));
}

}  // namespace km
