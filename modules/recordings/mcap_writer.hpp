#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "modules/recordings/mcap_records.hpp"

namespace km {

/// Produces the bytes of an MCAP file (mcap.dev/spec), version 0. Messages are in chunks with a
/// checksum. A chunk contains the definitions that are new in it, and the index of its messages
/// follows it. The end of the file has a checksum, definitions, statistics, and the chunk indexes.
/// A truncated file is readable up to its last complete chunk. Not thread-safe.
class McapWriter {
 public:
  struct Options {
    std::string profile = "ros2";
    std::string library = "kimera_multi";
    std::string compression = "zstd";                ///< "zstd", or "" for none.
    std::size_t chunk_bytes = std::size_t{1} << 20;  ///< Uncompressed size that ends a chunk.
  };

  explicit McapWriter(Options options);

  /// Adds a channel and returns its new id; the ids in `channel` and `schema` are ignored. A
  /// channel without messages is not written. Throws std::length_error for more than 65535 channels
  /// or schemas.
  std::uint16_t add_channel(McapChannel channel, const McapSchema& schema);

  /// Adds a message of a channel of add_channel().
  void add(const McapMessage& message, std::span<const std::uint8_t> data);

  /// Ends the chunk, unless it is empty.
  void end_chunk();

  /// Ends the chunk and adds a file behind it.
  void attach(const McapAttachment& attachment);

  /// Ends the file. Call once; afterwards only take() is allowed.
  void finish();

  /// The bytes produced since the last call.
  [[nodiscard]] std::vector<std::uint8_t> take();

 private:
  struct OpenChunk {
    ByteWriter records;
    Stamp start = 0, end = 0;
    std::size_t messages = 0;
    std::map<std::uint16_t, McapMessageIndex> indexes;
  };

  void define(const McapChannel& channel);
  void count(const McapMessage& message);
  void put_chunk();
  void put_message_indexes(McapChunkIndex& chunk);
  void put_summary();
  template <typename Record>
  void put(const Record& record);
  void append(std::span<const std::uint8_t> bytes);

  const Options options_;
  std::vector<McapSchema> schemas_;  // id - 1 is the index, as in channels_
  std::vector<McapChannel> channels_;
  std::set<std::uint16_t> written_schemas_, written_channels_;
  OpenChunk chunk_;
  std::vector<McapChunkIndex> chunks_;
  std::vector<McapAttachmentIndex> attachments_;
  McapStatistics statistics_;
  std::map<std::uint16_t, std::uint64_t> counts_;
  std::vector<std::uint8_t> bytes_;  // bytes that the caller has not taken yet
  std::uint64_t size_ = 0;           // size of the file so far [bytes]
  std::uint32_t crc_ = 0;            // checksum of the file so far
};

}  // namespace km
