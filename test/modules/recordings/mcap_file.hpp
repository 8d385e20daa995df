#pragma once

#include <lz4frame.h>
#include <zlib.h>
#include <zstd.h>

#include <algorithm>
#include <array>
#include <string>
#include <utility>
#include <vector>

#include "modules/core/bytes.hpp"
#include "modules/core/stamp.hpp"

namespace km {

/// Writes MCAP files after the specification, in the ways in which writers differ.
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
    file_.bytes(magic());
    put(file_, 0x01, [](ByteWriter& out) {
      text(out, "ros2");
      text(out, "test");
    });
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
    const Bytes packed = compressed(plain);
    const std::uint64_t begin = file_.size();
    put(file_, 0x06, [&](ByteWriter& out) {
      out.u64(static_cast<std::uint64_t>(start));
      out.u64(static_cast<std::uint64_t>(start));
      out.u64(plain.size());
      out.u32(options_.has_crc ? crc_of(plain) : 0);
      text(out, options_.compression);
      out.u64(packed.size());
      out.bytes(packed);
    });
    chunks_.push_back({start, begin, file_.size() - begin});
  }

  [[nodiscard]] std::string finish() {
    Bytes data = file_.release();
    ByteWriter tail;
    put(tail, 0x0F, [&](ByteWriter& out) { out.u32(options_.has_crc ? crc_of(data) : 0); });
    Bytes end = tail.release();
    data.insert(data.end(), end.begin(), end.end());
    const std::uint64_t summary_start = options_.has_summary ? data.size() : 0;
    ByteWriter summary;
    if (options_.has_summary) put_summary(summary);
    summary.u8(0x02);
    summary.u64(20);
    summary.u64(summary_start);
    summary.u64(0);
    Bytes bytes = summary.release();
    ByteWriter last;
    last.u32(options_.has_crc ? crc_of(bytes) : 0);
    last.bytes(magic());
    end = last.release();
    data.insert(data.end(), bytes.begin(), bytes.end());
    data.insert(data.end(), end.begin(), end.end());
    return {data.begin(), data.end()};
  }

 private:
  static constexpr std::array<std::uint16_t, 2> kChannels = {1, 2};

  struct IndexedChunk {
    Stamp start;
    std::uint64_t begin, size;
  };

  static Bytes magic() { return {0x89, 'M', 'C', 'A', 'P', '0', '\r', '\n'}; }
  static std::uint32_t crc_of(const Bytes& bytes) {
    return static_cast<std::uint32_t>(crc32_z(0, bytes.data(), bytes.size()));
  }
  static void text(ByteWriter& out, const std::string& value) {
    out.u32(static_cast<std::uint32_t>(value.size()));
    out.bytes(Bytes(value.begin(), value.end()));
  }

  template <typename Fields>
  static void put(ByteWriter& out, std::uint8_t opcode, const Fields& fields) {
    ByteWriter content;
    fields(content);
    out.u8(opcode);
    out.u64(content.size());
    out.bytes(content.release());
  }

  static void put_message(ByteWriter& out, const Message& message) {
    put(out, 0x05, [&](ByteWriter& content) {
      content.u16(message.channel);
      content.u32(0);
      content.u64(static_cast<std::uint64_t>(message.log_time));
      content.u64(0);
      content.bytes(message.bytes);
    });
  }

  // Numbers of messages of both channels.
  static void definitions(ByteWriter& out) {
    put(out, 0x03, [](ByteWriter& content) {
      content.u16(7);
      text(content, "sensor_msgs/msg/Imu");
      text(content, "ros2msg");
      text(content, "");
    });
    for (const std::uint16_t id : kChannels)
      put(out, 0x04, [&](ByteWriter& content) {
        content.u16(id);
        content.u16(7);
        text(content, "/imu" + std::to_string(id));
        text(content, "cdr");
        text(content, "");
      });
  }

  [[nodiscard]] Bytes compressed(const Bytes& plain) const {
    if (options_.compression.empty()) return plain;
    Bytes packed(2 * plain.size() + 1000);
    packed.resize(
        options_.compression == "lz4"
            ? LZ4F_compressFrame(packed.data(), packed.size(), plain.data(), plain.size(), nullptr)
            : ZSTD_compress(packed.data(), packed.size(), plain.data(), plain.size(), 1));
    return packed;
  }

  void put_summary(ByteWriter& out) const {
    if (options_.repeats_channels) definitions(out);
    put(out, 0x0B, [&](ByteWriter& content) {
      content.u64(counts_[1] + counts_[2]);
      content.u16(1);
      content.u32(2);
      content.u64(0);
      content.u32(static_cast<std::uint32_t>(chunks_.size()));
      content.u64(0);
      content.u64(0);
      content.u32(20);
      for (const std::uint16_t id : kChannels) {
        content.u16(id);
        content.u64(counts_[id]);
      }
    });
    for (const IndexedChunk& chunk : chunks_)
      put(out, 0x08, [&](ByteWriter& content) {
        content.u64(static_cast<std::uint64_t>(chunk.start));
        content.u64(static_cast<std::uint64_t>(chunk.start));
        content.u64(chunk.begin);
        content.u64(chunk.size);
        content.u32(0);
        content.u64(0);
        text(content, options_.compression);
        content.u64(0);
        content.u64(0);
      });
  }

  Options options_;
  ByteWriter file_;
  std::vector<IndexedChunk> chunks_;
  std::uint64_t counts_[3] = {};
};

}  // namespace km
