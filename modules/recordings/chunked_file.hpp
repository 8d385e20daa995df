#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "modules/recordings/channel_table.hpp"
#include "modules/recordings/chunk_merge.hpp"
#include "modules/recordings/random_access_file.hpp"

namespace km {

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
  std::uint64_t left_bytes_ = (std::uint64_t{64} << 20U) + 250 * file.size();
  std::optional<ChunkMerge> merge_;
};

}  // namespace km
