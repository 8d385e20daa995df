#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <vector>

#include "modules/recordings/bag_reader.hpp"

namespace km {

/// Range of a file that is read in one piece, and the time of its messages.
struct ChunkRange {
  std::uint64_t begin = 0;  ///< [bytes from the beginning of the file].
  std::uint64_t end = 0;    ///< Position behind the last byte that can belong to the part [bytes].
  Stamp first = 0;          ///< Lower bound on the log times of the messages [ns].
  bool is_bare = false;     ///< True for records outside of chunks.
};

/// Content of a part of a file.
struct Chunk {
  struct Entry {
    Stamp log_time = 0;
    std::uint32_t channel = 0;
    std::uint32_t size = 0;   ///< [bytes].
    std::uint64_t begin = 0;  ///< Position in `bytes`.
  };
  std::vector<std::uint8_t> bytes;
  std::vector<Entry> entries;  ///< In the order of the file.
};

/// Returns the messages of many chunks in order of time, and reads a chunk when its first message
/// is due. Chunks that overlap in time are in memory together. If they exceed kHeld_bytes, the
/// bytes of some chunks are removed and read again when they are due.
class ChunkMerge {
 public:
  static constexpr std::uint64_t kHeld_bytes = std::uint64_t{1} << 30U;

  /// Reads a chunk. Returns a chunk without entries if it is unusable.
  using Load = std::function<Chunk(const ChunkRange&)>;
  /// Called for a message that is dropped, because a later message has been returned or because
  /// the file has changed.
  using Lost = std::function<void(const ChunkRange&, const Chunk::Entry&)>;

  ChunkMerge(std::vector<ChunkRange> places, Load load, Lost lost,
             std::uint64_t held_bytes = kHeld_bytes);

  [[nodiscard]] std::optional<BagMessage> next();

 private:
  struct Open {
    ChunkRange place;
    Chunk chunk;
    std::size_t next = 0;  // index into chunk.entries, which are in order of time
  };

  void open_due();
  void open(const ChunkRange& place);
  void make_room();
  // Bytes of a message; nullopt if the file has changed since the chunk was opened.
  [[nodiscard]] std::optional<std::vector<std::uint8_t>> bytes_of(Open& open,
                                                                  const Chunk::Entry& entry);
  // The open chunk with the next message; open_ is not empty.
  [[nodiscard]] std::vector<Open>::iterator earliest();

  Load load_;
  Lost lost_;
  std::uint64_t max_held_bytes_;
  std::uint64_t held_bytes_ = 0;
  std::deque<ChunkRange> waiting_;  // chunks to be opened, in order of time, then position
  std::vector<Open> open_;
  std::optional<Stamp> last_;
};

}  // namespace km
