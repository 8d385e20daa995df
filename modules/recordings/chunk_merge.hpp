#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <vector>

#include "modules/recordings/bag_reader.hpp"

namespace km {

/// A part of a file that is read in one piece: its position, and the time of its messages.
struct ChunkPlace {
  std::uint64_t begin = 0;  ///< [bytes from the beginning of the file].
  std::uint64_t end = 0;    ///< Behind the last byte that can belong to it.
  Stamp first = 0;          ///< No message is earlier [ns].
  bool is_bare = false;     ///< Records that lie directly in the file, in no chunk.
};

/// Content of such a part.
struct Chunk {
  struct Entry {
    Stamp log_time = 0;
    std::uint32_t channel = 0;
    std::uint32_t size = 0;   ///< [bytes].
    std::uint64_t begin = 0;  ///< Into bytes.
  };
  std::vector<std::uint8_t> bytes;
  std::vector<Entry> entries;  ///< In the order of the file.
};

/// Returns the messages of many chunks in order of time; it reads a chunk when its first message is
/// due. Several chunks are in memory if they overlap in time. If they exceed kHeld_bytes, their
/// bytes are read again when they are due.
class ChunkMerge {
 public:
  static constexpr std::uint64_t kHeld_bytes = std::uint64_t{1} << 30U;

  /// Reads a chunk; returns one without entries if the chunk is unusable.
  using Load = std::function<Chunk(const ChunkPlace&)>;
  /// Called for a message that is dropped because it is earlier than one returned before.
  using Lost = std::function<void(const ChunkPlace&, const Chunk::Entry&)>;

  ChunkMerge(std::vector<ChunkPlace> places, Load load, Lost lost,
             std::uint64_t held_bytes = kHeld_bytes);

  [[nodiscard]] std::optional<BagMessage> next();

 private:
  struct Open {
    ChunkPlace place;
    Chunk chunk;
    std::size_t next = 0;  // index into chunk.entries, which are in order of time
  };

  void open_due();
  void open(const ChunkPlace& place);
  void make_room();
  // Nullopt if the file has changed meanwhile.
  [[nodiscard]] std::optional<std::vector<std::uint8_t>> bytes_of(Open& open,
                                                                  const Chunk::Entry& entry);
  // The open chunk with the next message; open_ is not empty.
  [[nodiscard]] std::vector<Open>::iterator earliest();

  Load load_;
  Lost lost_;
  std::uint64_t max_held_bytes_;
  std::uint64_t held_bytes_ = 0;
  std::deque<ChunkPlace> waiting_;  // chunks not opened yet, in order of time, then place
  std::vector<Open> open_;
  std::optional<Stamp> last_;
};

}  // namespace km
