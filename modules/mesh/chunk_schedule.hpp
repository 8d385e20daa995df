#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "modules/mesh/mesh_chunks.hpp"
#include "modules/mesh/mesh_poses.hpp"

namespace km {

/// Motion of a vertex along an axis, beyond that of the keyframes which saw it, after which its
/// chunk is sent again.
inline constexpr double kMinChunkMove_m = 0.01;

/// Selects the chunks of a changing mesh that are to be sent, and their order. Keys whose chunk was
/// never sent come first, then those sent longest ago, so that each has its turn at any rate of
/// changes. Only the newest chunk of a key is sent. It is not sent if differ() finds no difference
/// from the last sent chunk of this key.
///
/// Stores the last sent chunk of each key: as much as the mesh. Not thread-safe.
class ChunkSchedule {
 public:
  /// See differ().
  explicit ChunkSchedule(double min_move_m) : min_move_m_(min_move_m) {}

  /// Takes the whole current mesh, keys ascending. For each key that it no longer has, an empty
  /// chunk is sent once. `poses` are those with which receivers place the sent chunks, if any.
  void update(std::vector<MeshChunk> chunks, const MeshPoses* poses = nullptr);

  /// Discards the sent chunks, so that the next update() sends the whole mesh to new receivers. For
  /// keys that are missing in that update, empty chunks are sent to receivers with former chunks.
  void begin_again();

  /// The next chunk to send, which then counts as sent; nullopt if nothing has changed.
  [[nodiscard]] std::optional<MeshChunk> next();

  [[nodiscard]] std::size_t waiting() const { return order_.size(); }

 private:
  /// Chunks of one key.
  struct Versions {
    MeshChunk sent;          // last sent chunk; empty: there is none, or it is to be sent again
    bool is_out = false;     // a receiver may have a chunk that is not empty
    std::uint64_t turn = 0;  // value of turn_ when it was last sent; 0: never sent
    std::optional<MeshChunk> waiting;
  };
  void want(Versions& versions, MeshChunk chunk, const MeshPoses* poses);

  double min_move_m_;
  std::map<MeshChunkKey, Versions> versions_;
  std::set<std::pair<std::uint64_t, MeshChunkKey>> order_;  // keys of waiting chunks by turn
  std::uint64_t turn_ = 0;
};

}  // namespace km
