#pragma once

#include <array>
#include <string>
#include <utility>
#include <vector>

#include "modules/core/bytes.hpp"
#include "modules/core/stamp.hpp"
#include "modules/recordings/mcap_records.hpp"
#include "test/modules/recordings/compressed.hpp"

namespace km {

/// Writes MCAP files in the ways in which writers differ. The conformance suite checks the records
/// themselves.
class McapFile {
 public:
  using Bytes = std::vector<std::uint8_t>;
  struct Options {
    std::string compression;       ///< "", "lz4" or "zstd".
    bool has_crc = true;           ///< Checksums of chunks, of the summary and of the data.
    bool has_summary = true;       ///< Channels, statistics and chunk indexes.
    bool repeats_channels = true;  ///< In the summary.
  };
  struct Message {
    std::uint16_t channel = 0;  ///< 1 or 2.
    Stamp log_time = 0;
    Bytes bytes;
  };

  explicit McapFile(Options options) : options_(std::move(options)) {
    put_text(file_, kMcapMagic);
    put_mcap(file_, McapHeader{.profile = "ros2", .library = "test"});
    definitions(file_);
  }

  /// Outside of chunks.
  void add(const Message& message) {
    put_message(file_, message);
    ++counts_[message.channel];
  }

  /// A chunk that describes its channels, too. `start` is what it says of its first message.
  void add_chunk(const std::vector<Message>& messages, Stamp start) {
    ByteWriter records;
    definitions(records);
    for (const Message& message : messages) {
      put_message(records, message);
      ++counts_[message.channel];
    }
    const Bytes plain = records.release();
    const Bytes packed = compressed(options_.compression, plain);
    const std::uint64_t begin = file_.size();
    put_mcap(file_, McapChunk{.message_start_time = start,
                              .message_end_time = start,
                              .uncompressed_size = plain.size(),
                              .uncompressed_crc = crc_of(plain),
                              .compression = options_.compression,
                              .records = packed});
    chunks_.push_back({.message_start_time = start,
                       .message_end_time = start,
                       .chunk_start = begin,
                       .chunk_length = file_.size() - begin,
                       .compression = options_.compression});
  }

  [[nodiscard]] std::string finish() {
    Bytes data = file_.release();
    ByteWriter tail;
    put_mcap(tail, McapDataEnd{.data_section_crc = crc_of(data)});
    const std::uint64_t summary_start = data.size() + tail.size();
    file_.bytes(data);
    file_.bytes(tail.release());
    ByteWriter summary;
    if (options_.has_summary) put_summary(summary);
    McapFooter footer{.summary_start = options_.has_summary ? summary_start : 0};
    put_mcap(summary, footer);
    // The checksum covers the summary and the footer before the checksum.
    Bytes bytes = summary.release();
    bytes.resize(bytes.size() - sizeof(footer.summary_crc));
    file_.bytes(bytes);
    file_.u32(crc_of(bytes));
    put_text(file_, kMcapMagic);
    data = file_.release();
    return {data.begin(), data.end()};
  }

 private:
  static constexpr std::array<std::uint16_t, 2> kChannels = {1, 2};

  [[nodiscard]] std::uint32_t crc_of(const Bytes& bytes) const {
    return options_.has_crc ? mcap_crc(bytes) : 0;
  }
  static void put_text(ByteWriter& out, std::string_view text) {
    for (const char c : text) out.u8(static_cast<std::uint8_t>(c));
  }

  static void put_message(ByteWriter& out, const Message& message) {
    put_mcap_message(out, {.channel_id = message.channel, .log_time = message.log_time},
                     message.bytes);
  }

  static void definitions(ByteWriter& out) {
    constexpr std::uint16_t kSchema = 7;
    put_mcap(out,
             McapSchema{
                 .id = kSchema, .name = "sensor_msgs/msg/Imu", .encoding = "ros2msg", .data = ""});
    for (const std::uint16_t id : kChannels)
      put_mcap(out, McapChannel{.id = id,
                                .schema_id = kSchema,
                                .topic = "/imu" + std::to_string(id),
                                .message_encoding = "cdr"});
  }

  void put_summary(ByteWriter& out) const {
    if (options_.repeats_channels) definitions(out);
    McapStatistics statistics{.message_count = counts_[1] + counts_[2],
                              .schema_count = 1,
                              .channel_count = 2,
                              .chunk_count = static_cast<std::uint32_t>(chunks_.size()),
                              .channel_message_counts = {}};
    for (const std::uint16_t id : kChannels)
      statistics.channel_message_counts.emplace_back(id, counts_[id]);
    put_mcap(out, statistics);
    for (const McapChunkIndex& chunk : chunks_) put_mcap(out, chunk);
  }

  Options options_;
  ByteWriter file_;
  std::vector<McapChunkIndex> chunks_;
  std::uint64_t counts_[3] = {};
};

}  // namespace km
