#pragma once

#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "modules/core/decoded.hpp"
#include "modules/core/io/descriptor.hpp"
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

/// Maximum decompressed size of a chunk or message.
inline constexpr std::uint64_t kMaxDecompressed_bytes = std::uint64_t{512} << 20U;

/// Decompresses to `size` bytes. `compression` is "none" or "" (a copy), "lz4" (frames), "zstd", or
/// "bz2". Refuses a result of another size.
Decoded<std::vector<std::uint8_t>> decompress(std::string_view compression,
                                              std::span<const std::uint8_t> bytes,
                                              std::uint64_t size);

/// Compressed bytes that state more than kExpected_bytes and kExpectedRatio times their own size
/// are refused, because kilobytes can decompress to gigabytes.
inline constexpr std::uint64_t kExpected_bytes = std::uint64_t{64} << 20U, kExpectedRatio = 250;

/// Decompresses the zstd frame of a message that a recorder has compressed by itself.
Decoded<std::vector<std::uint8_t>> decompress_message(std::span<const std::uint8_t> bytes);

/// A file that is read at any position. Not thread-safe.
class RandomAccessFile {
 public:
  /// Throws InputFileError if `path` is no readable regular file.
  explicit RandomAccessFile(const std::filesystem::path& path);

  /// Size of the file when it was opened [bytes].
  [[nodiscard]] std::uint64_t size() const { return size_; }

  /// True if [offset, offset + size) is within the file.
  [[nodiscard]] bool has(std::uint64_t offset, std::uint64_t size) const {
    return offset <= size_ && size <= size_ - offset;
  }

  /// The bytes [offset, offset + size). Throws InputFileError if they cannot be read. Precondition:
  /// has(offset, size).
  [[nodiscard]] std::vector<std::uint8_t> read(std::uint64_t offset, std::uint64_t size) const;

  /// The first `size` bytes as text; all of a shorter file.
  [[nodiscard]] std::string beginning(std::uint64_t size) const;

  /// Position for messages: "FILE byte OFFSET".
  [[nodiscard]] std::string place(std::uint64_t offset) const;

 private:
  std::filesystem::path path_;
  Descriptor descriptor_;
  std::uint64_t size_ = 0;
};

/// A recording that is read chunk by chunk, with its channels and its faults. A chunk is read when
/// its first message is due. Readers of the formats parse the chunks.
class ChunkedFile {
 public:
  /// `parse` returns a chunk without entries if it is unusable. Throws InputFileError if `path` is
  /// no file.
  ChunkedFile(const std::filesystem::path& path, std::function<Chunk(const ChunkRange&)> parse)
      : file(path), parse_(std::move(parse)) {}

  const RandomAccessFile file;
  ChannelTable channels;
  std::vector<ChunkRange> places;  ///< Chunks of the file, complete before next().

  /// Adds a fault with its byte position. Faults of a chunk that is read again are not counted
  /// again.
  void fault(BagFault kind, std::uint64_t offset, const std::string& why) {
    if (!is_known_) faults_.add(kind, file.place(offset) + ": " + why);
  }
  [[nodiscard]] const BagReport& faults() const { return faults_; }

  /// Decompresses the chunk at `begin`; empty with a fault if that fails. All chunks of a file may
  /// decompress to 64 MiB and 250 times the size of the file, because kilobytes can decompress to
  /// gigabytes. Recordings of sensors stay far below.
  [[nodiscard]] std::vector<std::uint8_t> unpack(std::uint64_t begin,
                                                 const std::string& compression,
                                                 std::span<const std::uint8_t> bytes,
                                                 std::uint64_t size);

  /// Adds the chunk at [begin, end), which no index describes. Counts its messages if `counts`.
  void scan(std::uint64_t begin, std::uint64_t end, bool counts = true);

  /// The next message in order of time.
  [[nodiscard]] std::optional<BagMessage> next();

 private:
  [[nodiscard]] Chunk load(const ChunkRange& place);

  const std::function<Chunk(const ChunkRange&)> parse_;
  BagReport faults_;
  std::set<std::uint64_t> read_, unpacked_;  // positions of chunks
  bool is_known_ = false;                    // the chunk is read again
  std::uint64_t left_bytes_ = kExpected_bytes + kExpectedRatio * file.size();
  std::optional<ChunkMerge> merge_;
};

}  // namespace km
