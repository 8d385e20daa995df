#include "modules/mesh/chunk_schedule.hpp"

#include "modules/mesh/mesh_chunks.hpp"

namespace km {

void ChunkSchedule::want(Piece& piece, MeshChunk chunk) {
  const MeshChunkKey key = chunk.key;
  const bool news =
      chunk.empty() ? piece.is_out : piece.sent.empty() || differ(piece.sent, chunk, min_move_m_);
  if (news) {
    piece.waiting = std::move(chunk);
    order_.emplace(piece.turn, key);
  } else {
    piece.waiting.reset();
    order_.erase({piece.turn, key});
  }
}

void ChunkSchedule::update(std::vector<MeshChunk> chunks) {
  auto chunk = chunks.begin();
  for (auto known = pieces_.begin(); known != pieces_.end(); ++known) {
    while (chunk != chunks.end() && chunk->key < known->first) {
      const MeshChunkKey key = chunk->key;
      want(pieces_[key], std::move(*chunk++));  // a new piece before `known`
    }
    if (chunk != chunks.end() && chunk->key == known->first)
      want(known->second, std::move(*chunk++));
    else
      want(known->second, MeshChunk{.key = known->first});
  }
  for (; chunk != chunks.end(); ++chunk) {
    const MeshChunkKey key = chunk->key;
    want(pieces_[key], std::move(*chunk));
  }
}

void ChunkSchedule::begin_again() {
  order_.clear();
  for (auto& [key, piece] : pieces_) piece = {.sent = {}, .is_out = piece.is_out, .waiting = {}};
}

std::optional<MeshChunk> ChunkSchedule::next() {
  if (order_.empty()) return std::nullopt;
  Piece& piece = pieces_.at(order_.begin()->second);
  order_.erase(order_.begin());
  piece.turn = ++turn_;
  piece.sent = *std::move(piece.waiting);
  piece.waiting.reset();
  piece.is_out = !piece.sent.empty();
  return piece.sent;
}

}  // namespace km
