#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "modules/mesh/mesh_chunks.hpp"

namespace km {

/// Selects the chunks of a changing mesh that are to be sent, and their order. Chunks that were
/// never sent come first, then those sent longest ago, so that each has its turn at any rate of
/// changes. Only the newest state of a piece is sent. It is not sent if differ() finds no
/// difference from the sent state.
///
/// Stores the sent state, which is as large as the mesh. Not thread-safe.
class ChunkSchedule {
 public:
  /// See differ().
  explicit ChunkSchedule(double min_move_m) : min_move_m_(min_move_m) {}

  /// The whole current mesh, keys ascending. Each piece that has vanished is sent once more, empty.
  void update(std::vector<MeshChunk> chunks);

  /// Frees the sent state, so that the next update() sends the whole mesh to new receivers. Pieces
  /// that are missing in that update are sent empty, for receivers that still have them.
  void begin_again();

  /// The next chunk to send, which then counts as sent; nullopt if nothing has changed.
  [[nodiscard]] std::optional<MeshChunk> next();

  [[nodiscard]] std::size_t waiting() const { return order_.size(); }

 private:
  struct Piece {
    MeshChunk sent;          // empty: the piece is absent, or is to be sent again
    bool is_out = false;     // a receiver may have it
    std::uint64_t turn = 0;  // value of turn_ when it was last sent; 0: never sent
    std::optional<MeshChunk> waiting;
  };
  void want(Piece& piece, MeshChunk chunk);

  double min_move_m_;
  std::map<MeshChunkKey, Piece> pieces_;
  std::set<std::pair<std::uint64_t, MeshChunkKey>> order_;  // waiting pieces by turn
  std::uint64_t turn_ = 0;
};

}  // namespace km
