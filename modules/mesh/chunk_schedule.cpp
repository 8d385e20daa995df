#include "modules/mesh/chunk_schedule.hpp"

#include "modules/mesh/chunk_placement.hpp"

namespace km {

void ChunkSchedule::want(Versions& versions, MeshChunk chunk, const MeshPoses* poses) {
  const MeshChunkKey key = chunk.key;
  const bool news = chunk.empty()
                        ? versions.is_out
                        : versions.sent.empty() || differ(versions.sent, chunk, min_move_m_, poses);
  if (news) {
    versions.waiting = std::move(chunk);
    order_.emplace(versions.turn, key);
  } else {
    versions.waiting.reset();
    order_.erase({versions.turn, key});
  }
}

void ChunkSchedule::update(std::vector<MeshChunk> chunks, const MeshPoses* poses) {
  auto chunk = chunks.begin();
  for (auto known = versions_.begin(); known != versions_.end(); ++known) {
    while (chunk != chunks.end() && chunk->key < known->first) {
      const MeshChunkKey key = chunk->key;
      want(versions_[key], std::move(*chunk++), poses);  // a new key before `known`
    }
    if (chunk != chunks.end() && chunk->key == known->first)
      want(known->second, std::move(*chunk++), poses);
    else
      want(known->second, MeshChunk{.key = known->first}, poses);
  }
  for (; chunk != chunks.end(); ++chunk) {
    const MeshChunkKey key = chunk->key;
    want(versions_[key], std::move(*chunk), poses);
  }
}

void ChunkSchedule::begin_again() {
  order_.clear();
  for (auto& [key, versions] : versions_)
    versions = {.sent = {}, .is_out = versions.is_out, .waiting = {}};
}

std::optional<MeshChunk> ChunkSchedule::next() {
  if (order_.empty()) return std::nullopt;
  Versions& versions = versions_.at(order_.begin()->second);
  order_.erase(order_.begin());
  versions.turn = ++turn_;
  versions.sent = *std::move(versions.waiting);
  versions.waiting.reset();
  versions.is_out = !versions.sent.empty();
  return versions.sent;
}

}  // namespace km
