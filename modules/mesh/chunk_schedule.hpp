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

/// Which chunks of a mesh that changes are to be sent, and in which order: those never sent first,
/// then those sent longest ago, so that each has its turn however often the mesh changes. Of a
/// piece that changed twice only the newest state is sent, of one that changed back nothing.
///
/// Keeps what was sent last, as large as the mesh. Not thread-safe.
class ChunkSchedule {
 public:
  /// See differ().
  explicit ChunkSchedule(double min_move_m) : min_move_m_(min_move_m) {}

  /// The mesh as it is now, all of it: keys ascending. Pieces that are no longer there will be
  /// sent once more, empty.
  void update(std::vector<MeshChunk> chunks);

  /// From now on all is to be sent again, as to somebody who has nothing. Pieces that were sent and
  /// are not in what update() is given next are sent empty to those who have them. What was sent
  /// takes no memory until then.
  void begin_again();

  /// The next chunk to send, which counts as sent then; nullopt if nothing has changed.
  [[nodiscard]] std::optional<MeshChunk> next();

  [[nodiscard]] std::size_t waiting() const { return order_.size(); }

 private:
  struct Piece {
    MeshChunk sent;          // empty: not there, or to be sent again
    bool is_out = false;     // somebody may have it
    std::uint64_t turn = 0;  // when it was sent; 0: never
    std::optional<MeshChunk> waiting;
  };
  void want(Piece& piece, MeshChunk chunk);

  double min_move_m_;
  std::map<MeshChunkKey, Piece> pieces_;
  std::set<std::pair<std::uint64_t, MeshChunkKey>> order_;  // of those that wait
  std::uint64_t turn_ = 0;
};

}  // namespace km
