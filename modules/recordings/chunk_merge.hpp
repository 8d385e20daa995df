#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <vector>

#include "modules/recordings/bag_reader.hpp"

namespace km {

/// A part of a file that is read as one: where it lies and when its messages were recorded.
struct ChunkPlace {
  std::uint64_t begin = 0;  ///< [bytes from the beginning of the file].
  std::uint64_t end = 0;    ///< Behind the last byte that can belong to it.
  Stamp first = 0;          ///< No message is earlier [ns].
  bool is_bare = false;     ///< Records that lie in the file as they are, in no chunk.
};

/// What such a part holds.
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

/// Gives the messages of many chunks in order of time, reading a chunk when its first message is
/// due. Of chunks that overlap in time several are in memory, and where these come to more than
/// kHeld_bytes, their bytes are read again when their turn comes.
class ChunkMerge {
 public:
  static constexpr std::uint64_t kHeld_bytes = std::uint64_t{1} << 30U;

  /// Reads a chunk; one without entries if it cannot be used.
  using Load = std::function<Chunk(const ChunkPlace&)>;
  /// Told of a message that is lost: it is earlier than one given before.
  using Lost = std::function<void(const ChunkPlace&, const Chunk::Entry&)>;

  ChunkMerge(std::vector<ChunkPlace> places, Load load, Lost lost,
             std::uint64_t held_bytes = kHeld_bytes);

  [[nodiscard]] std::optional<BagMessage> next();

 private:
  struct Open {
    ChunkPlace place;
    Chunk chunk;
    std::size_t next = 0;  // of chunk.entries, which are in order of time
  };

  void open_due();
  void open(const ChunkPlace& place);
  void make_room();
  // Nothing if the file has changed meanwhile.
  [[nodiscard]] std::optional<std::vector<std::uint8_t>> bytes_of(Open& open,
                                                                  const Chunk::Entry& entry);
  // The open chunk whose turn it is; open_ is not empty.
  [[nodiscard]] std::vector<Open>::iterator earliest();

  Load load_;
  Lost lost_;
  std::uint64_t max_held_bytes_;
  std::uint64_t held_bytes_ = 0;
  std::deque<ChunkPlace> waiting_;  // in order of time, then place
  std::vector<Open> open_;
  std::optional<Stamp> last_;
};

}  // namespace km
