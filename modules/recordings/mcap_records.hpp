#pragma once

#include <zlib.h>

#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "modules/core/io/bytes.hpp"
#include "modules/core/stamp.hpp"

namespace km {

/// Records of an MCAP file (mcap.dev/spec). A record is a byte with the opcode, eight bytes with
/// the size of the content, little endian, and the content. Unknown fields at the end of the
/// content are ignored, as the specification demands.
enum class McapOpcode : std::uint8_t {
  kHeader = 0x01,
  kFooter = 0x02,
  kSchema = 0x03,
  kChannel = 0x04,
  kMessage = 0x05,
  kChunk = 0x06,
  kMessageIndex = 0x07,
  kChunkIndex = 0x08,
  kAttachment = 0x09,
  kAttachmentIndex = 0x0A,
  kStatistics = 0x0B,
  kSummaryOffset = 0x0E,
  kDataEnd = 0x0F,
};

/// The first and also the last bytes of a file.
inline constexpr std::string_view kMcapMagic{"\x89MCAP0\r\n", 8};
/// The latest time that a Stamp can hold [ns].
inline constexpr auto kMcapLatest = static_cast<std::uint64_t>(std::numeric_limits<Stamp>::max());
/// Size of opcode and length.
inline constexpr std::uint64_t kMcapRecordHeader_bytes = 9;

struct McapRecordHeader {
  std::uint8_t opcode = 0;
  std::uint64_t size = 0;  ///< Size of the content that follows [bytes].

  [[nodiscard]] bool is(McapOpcode kind) const { return opcode == static_cast<std::uint8_t>(kind); }
};

struct McapHeader {
  static constexpr McapOpcode kOpcode = McapOpcode::kHeader;
  std::string profile;  ///< "ros2", ...
  std::string library;  ///< Library that wrote the file.

  static void visit(auto& wire, auto& m) { wire(m.profile, m.library); }
};

struct McapFooter {
  static constexpr McapOpcode kOpcode = McapOpcode::kFooter;
  std::uint64_t summary_start = 0;         ///< [bytes from the beginning of the file]; 0: none.
  std::uint64_t summary_offset_start = 0;  ///< [bytes from the beginning of the file]; 0: none.
  std::uint32_t summary_crc = 0;           ///< Checksum; 0: none.

  static void visit(auto& wire, auto& m) {
    wire(m.summary_start, m.summary_offset_start, m.summary_crc);
  }
};
inline constexpr std::uint64_t kMcapFooterFields_bytes = 8 + 8 + 4;

struct McapSchema {
  static constexpr McapOpcode kOpcode = McapOpcode::kSchema;
  std::uint16_t id = 0;  ///< Not 0.
  std::string name;      ///< "nav_msgs/msg/Path"
  std::string encoding;  ///< Encoding of the definition: "ros2msg", ...
  std::string data;      ///< The definition.

  static void visit(auto& wire, auto& m) { wire(m.id, m.name, m.encoding, m.data); }
};

struct McapChannel {
  static constexpr McapOpcode kOpcode = McapOpcode::kChannel;
  std::uint16_t id = 0;
  std::uint16_t schema_id = 0;  ///< McapSchema::id; 0: no schema.
  std::string topic;
  std::string message_encoding;  ///< "cdr", ...
  std::map<std::string, std::string> metadata = {};

  static void visit(auto& wire, auto& m) {
    wire(m.id, m.schema_id, m.topic, m.message_encoding, m.metadata);
  }
};

/// Fields of a message. Its data follow them.
struct McapMessage {
  static constexpr McapOpcode kOpcode = McapOpcode::kMessage;
  std::uint16_t channel_id = 0;
  std::uint32_t sequence = 0;
  Stamp log_time = 0;
  Stamp publish_time = 0;

  static void visit(auto& wire, auto& m) {
    wire(m.channel_id, m.sequence, m.log_time, m.publish_time);
  }
};
inline constexpr std::uint64_t kMcapMessageFields_bytes = 2 + 4 + 8 + 8;

struct McapChunk {
  static constexpr McapOpcode kOpcode = McapOpcode::kChunk;
  Stamp message_start_time = 0;
  Stamp message_end_time = 0;
  std::uint64_t uncompressed_size = 0;
  std::uint32_t uncompressed_crc = 0;  ///< Checksum of the uncompressed records; 0: none.
  std::string compression;
  std::span<const std::uint8_t> records;  ///< Records as compressed; refers to bytes of the caller.

  static void visit(auto& wire, auto& m) {
    wire(m.message_start_time, m.message_end_time, m.uncompressed_size, m.uncompressed_crc,
         m.compression, m.records);
  }
};

/// Index of the messages of one channel in the chunk before it.
struct McapMessageIndex {
  static constexpr McapOpcode kOpcode = McapOpcode::kMessageIndex;
  std::uint16_t channel_id = 0;
  /// Log time, and position of the record in the uncompressed records of the chunk [bytes].
  std::vector<std::pair<std::uint64_t, std::uint64_t>> messages;

  static void visit(auto& wire, auto& m) { wire(m.channel_id, m.messages); }
};

struct McapChunkIndex {
  static constexpr McapOpcode kOpcode = McapOpcode::kChunkIndex;
  Stamp message_start_time = 0;
  Stamp message_end_time = 0;
  std::uint64_t chunk_start = 0;   ///< [bytes from the beginning of the file].
  std::uint64_t chunk_length = 0;  ///< Length of the record with its header [bytes].
  /// Position of the message index of each channel [bytes from the beginning of the file].
  std::vector<std::pair<std::uint16_t, std::uint64_t>> message_index_offsets = {};
  std::uint64_t message_index_length = 0;  ///< Total length of the message indexes [bytes].
  std::string compression;
  std::uint64_t compressed_size = 0;
  std::uint64_t uncompressed_size = 0;

  static void visit(auto& wire, auto& m) {
    wire(m.message_start_time, m.message_end_time, m.chunk_start, m.chunk_length,
         m.message_index_offsets, m.message_index_length, m.compression, m.compressed_size,
         m.uncompressed_size);
  }
};

/// A file inside the MCAP file. A checksum of the fields follows them.
struct McapAttachment {
  static constexpr McapOpcode kOpcode = McapOpcode::kAttachment;
  Stamp log_time = 0;
  Stamp create_time = 0;
  std::string name;
  std::string media_type;              ///< "text/csv", ...
  std::span<const std::uint8_t> data;  ///< Content; refers to bytes of the caller.

  static void visit(auto& wire, auto& m) {
    wire(m.log_time, m.create_time, m.name, m.media_type, m.data);
    wire.crc();
  }
};

struct McapAttachmentIndex {
  static constexpr McapOpcode kOpcode = McapOpcode::kAttachmentIndex;
  std::uint64_t start = 0;   ///< [bytes from the beginning of the file]
  std::uint64_t length = 0;  ///< Length of the record with its header [bytes].
  Stamp log_time = 0;
  Stamp create_time = 0;
  std::uint64_t data_size = 0;
  std::string name;
  std::string media_type;

  static void visit(auto& wire, auto& m) {
    wire(m.start, m.length, m.log_time, m.create_time, m.data_size, m.name, m.media_type);
  }
};

struct McapStatistics {
  static constexpr McapOpcode kOpcode = McapOpcode::kStatistics;
  std::uint64_t message_count = 0;
  std::uint16_t schema_count = 0;
  std::uint32_t channel_count = 0;
  std::uint32_t attachment_count = 0;
  std::uint32_t metadata_count = 0;
  std::uint32_t chunk_count = 0;
  Stamp message_start_time = 0;
  Stamp message_end_time = 0;
  std::vector<std::pair<std::uint16_t, std::uint64_t>> channel_message_counts;

  static void visit(auto& wire, auto& m) {
    wire(m.message_count, m.schema_count, m.channel_count, m.attachment_count, m.metadata_count,
         m.chunk_count, m.message_start_time, m.message_end_time, m.channel_message_counts);
  }
};

/// Position of the records of one kind in the summary.
struct McapSummaryOffset {
  static constexpr McapOpcode kOpcode = McapOpcode::kSummaryOffset;
  std::uint8_t group_opcode = 0;
  std::uint64_t group_start = 0;   ///< [bytes from the beginning of the file].
  std::uint64_t group_length = 0;  ///< [bytes]

  static void visit(auto& wire, auto& m) { wire(m.group_opcode, m.group_start, m.group_length); }
};

struct McapDataEnd {
  static constexpr McapOpcode kOpcode = McapOpcode::kDataEnd;
  std::uint32_t data_section_crc = 0;  ///< Checksum of all bytes before this record; 0: none.

  static void visit(auto& wire, auto& m) { wire(m.data_section_crc); }
};

/// Checksum (CRC-32) of `bytes`, continued from the checksum `before` of the preceding bytes.
[[nodiscard]] inline std::uint32_t mcap_crc(std::span<const std::uint8_t> bytes,
                                            std::uint32_t before = 0) {
  return static_cast<std::uint32_t>(crc32_z(before, bytes.data(), bytes.size()));
}

/// Reads the fields of a record, one after the other.
class McapIn {
 public:
  explicit McapIn(std::span<const std::uint8_t> bytes) : bytes_(bytes), reader_(bytes) {}

  template <typename... Fields>
  void operator()(Fields&... fields) {
    (get(fields), ...);
  }
  // Checksum of all bytes before it; 0: no checksum.
  void crc() {
    const auto before = bytes_.first(bytes_.size() - reader_.left());
    const std::uint32_t crc = reader_.u32();
    if (!reader_.failed() && crc != 0 && crc != mcap_crc(before)) reader_.fail();
  }

  [[nodiscard]] bool failed() const { return reader_.failed(); }

 private:
  void get(std::uint8_t& value) { value = reader_.u8(); }
  void get(std::uint16_t& value) { value = reader_.u16(); }
  void get(std::uint32_t& value) { value = reader_.u32(); }
  void get(std::uint64_t& value) { value = reader_.u64(); }
  void get(Stamp& value) {
    const std::uint64_t time = reader_.u64();
    value = static_cast<Stamp>(time <= kMcapLatest ? time : reader_.fail());
  }
  void get(std::string& value) {
    const auto bytes = reader_.bytes(reader_.u32());
    value.assign(bytes.begin(), bytes.end());
  }
  void get(std::span<const std::uint8_t>& value) { value = reader_.bytes(reader_.u64()); }
  // A map or list of pairs, preceded by its length in bytes.
  template <typename Key, typename Value>
  void get(std::vector<std::pair<Key, Value>>& values) {
    McapIn in(reader_.bytes(reader_.u32()));
    values.reserve(in.reader_.left() / (sizeof(Key) + sizeof(Value)));
    while (in.reader_.left() > 0) {
      auto& [key, value] = values.emplace_back();
      in(key, value);
    }
    if (in.failed()) reader_.fail();
  }
  void get(std::map<std::string, std::string>& values) {
    McapIn in(reader_.bytes(reader_.u32()));
    while (in.reader_.left() > 0) {
      std::string key;
      in(key);
      in(values[key]);
    }
    if (in.failed()) reader_.fail();
  }

  std::span<const std::uint8_t> bytes_;
  ByteReader reader_;
};

/// Writes the fields that McapIn reads.
class McapOut {
 public:
  template <typename... Fields>
  void operator()(const Fields&... fields) {
    (put(fields), ...);
  }
  void crc() {
    const auto bytes = writer_.release();
    writer_.bytes(bytes);
    writer_.u32(mcap_crc(bytes));
  }

  [[nodiscard]] std::vector<std::uint8_t> release() { return writer_.release(); }

 private:
  void put(std::uint8_t value) { writer_.u8(value); }
  void put(std::uint16_t value) { writer_.u16(value); }
  void put(std::uint32_t value) { writer_.u32(value); }
  void put(std::uint64_t value) { writer_.u64(value); }
  void put(Stamp value) { writer_.u64(static_cast<std::uint64_t>(value)); }
  void put(const std::string& value) {
    writer_.u32(static_cast<std::uint32_t>(value.size()));
    writer_.bytes({reinterpret_cast<const std::uint8_t*>(value.data()), value.size()});
  }
  void put(std::span<const std::uint8_t> value) {
    writer_.u64(value.size());
    writer_.bytes(value);
  }
  // A map or list of pairs.
  void put(const auto& pairs) {
    McapOut out;
    for (const auto& [key, value] : pairs) out(key, value);
    const auto bytes = out.release();
    writer_.u32(static_cast<std::uint32_t>(bytes.size()));
    writer_.bytes(bytes);
  }

  ByteWriter writer_;
};

[[nodiscard]] inline std::optional<McapRecordHeader> parse_mcap_record_header(
    std::span<const std::uint8_t> bytes) {
  ByteReader reader(bytes);
  McapRecordHeader header;
  header.opcode = reader.u8();
  header.size = reader.u64();
  if (reader.failed() || header.opcode == 0) return std::nullopt;
  return header;
}

/// Parses the content after a record's header, for the record types that readers use. nullopt for
/// an invalid content, times beyond 2^63 - 1 ns, and attachments with a wrong checksum.
template <typename Record>
[[nodiscard]] std::optional<Record> parse_mcap(std::span<const std::uint8_t> bytes) {
  McapIn in(bytes);
  Record record;
  Record::visit(in, record);
  if (in.failed()) return std::nullopt;
  if constexpr (std::is_same_v<Record, McapSchema>)
    if (record.id == 0) return std::nullopt;
  return record;
}

/// Writes a record with its header; `data` follows its fields.
template <typename Record>
void put_mcap(ByteWriter& out, const Record& record, std::span<const std::uint8_t> data = {}) {
  McapOut content;
  Record::visit(content, record);
  const auto bytes = content.release();
  out.u8(static_cast<std::uint8_t>(Record::kOpcode));
  out.u64(bytes.size() + data.size());
  out.bytes(bytes);
  out.bytes(data);
}

}  // namespace km
