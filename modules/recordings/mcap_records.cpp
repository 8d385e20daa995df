#include "modules/recordings/mcap_records.hpp"

#include <zlib.h>

#include <concepts>
#include <limits>
#include <type_traits>

namespace km {
namespace {

constexpr auto kLatest = static_cast<std::uint64_t>(std::numeric_limits<Stamp>::max());

// Reads fields, one after the other.
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
    value = static_cast<Stamp>(time <= kLatest ? time : reader_.fail());
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

// Writes the fields that McapIn reads.
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

// The fields of each record in the order of the specification, for reading and writing.
template <typename Record, typename Type>
concept RecordIs = std::same_as<std::remove_const_t<Record>, Type>;

void fields(auto& wire, RecordIs<McapHeader> auto& header) {
  wire(header.profile, header.library);
}

void fields(auto& wire, RecordIs<McapFooter> auto& footer) {
  wire(footer.summary_start, footer.summary_offset_start, footer.summary_crc);
}

void fields(auto& wire, RecordIs<McapSchema> auto& schema) {
  wire(schema.id, schema.name, schema.encoding, schema.data);
}

void fields(auto& wire, RecordIs<McapChannel> auto& channel) {
  wire(channel.id, channel.schema_id, channel.topic, channel.message_encoding, channel.metadata);
}

void fields(auto& wire, RecordIs<McapChunk> auto& chunk) {
  wire(chunk.message_start_time, chunk.message_end_time, chunk.uncompressed_size,
       chunk.uncompressed_crc, chunk.compression, chunk.records);
}

void fields(auto& wire, RecordIs<McapMessageIndex> auto& index) {
  wire(index.channel_id, index.messages);
}

void fields(auto& wire, RecordIs<McapChunkIndex> auto& index) {
  wire(index.message_start_time, index.message_end_time, index.chunk_start, index.chunk_length,
       index.message_index_offsets, index.message_index_length, index.compression,
       index.compressed_size, index.uncompressed_size);
}

void fields(auto& wire, RecordIs<McapAttachment> auto& attachment) {
  wire(attachment.log_time, attachment.create_time, attachment.name, attachment.media_type,
       attachment.data);
  wire.crc();
}

void fields(auto& wire, RecordIs<McapAttachmentIndex> auto& index) {
  wire(index.start, index.length, index.log_time, index.create_time, index.data_size, index.name,
       index.media_type);
}

void fields(auto& wire, RecordIs<McapStatistics> auto& statistics) {
  wire(statistics.message_count, statistics.schema_count, statistics.channel_count,
       statistics.attachment_count, statistics.metadata_count, statistics.chunk_count,
       statistics.message_start_time, statistics.message_end_time,
       statistics.channel_message_counts);
}

void fields(auto& wire, RecordIs<McapSummaryOffset> auto& offset) {
  wire(offset.group_opcode, offset.group_start, offset.group_length);
}

void fields(auto& wire, RecordIs<McapDataEnd> auto& end) {
  wire(end.data_section_crc);
}

}  // namespace

std::uint32_t mcap_crc(std::span<const std::uint8_t> bytes, std::uint32_t before) {
  return static_cast<std::uint32_t>(crc32_z(before, bytes.data(), bytes.size()));
}

std::optional<McapRecordHeader> parse_mcap_record_header(std::span<const std::uint8_t> bytes) {
  ByteReader reader(bytes);
  McapRecordHeader header;
  header.opcode = reader.u8();
  header.size = reader.u64();
  if (reader.failed() || header.opcode == 0) return std::nullopt;
  return header;
}

template <typename Record>
std::optional<Record> parse_mcap(std::span<const std::uint8_t> bytes) {
  McapIn in(bytes);
  Record record;
  fields(in, record);
  if (in.failed()) return std::nullopt;
  if constexpr (std::same_as<Record, McapSchema>)
    if (record.id == 0) return std::nullopt;
  return record;
}

std::optional<McapMessage> parse_mcap_message(std::span<const std::uint8_t> bytes,
                                              std::uint64_t size) {
  ByteReader reader(bytes);
  McapMessage message;
  message.channel_id = reader.u16();
  message.sequence = reader.u32();
  const std::uint64_t log_time = reader.u64();
  message.log_time = static_cast<Stamp>(log_time);
  message.publish_time = static_cast<Stamp>(reader.u64());  // not checked, because it is not used
  if (reader.failed() || log_time > kLatest ||
      size - kMcapMessageFields_bytes > std::numeric_limits<std::uint32_t>::max())
    return std::nullopt;
  message.data_size = static_cast<std::uint32_t>(size - kMcapMessageFields_bytes);
  return message;
}

template <typename Record>
void put_mcap(ByteWriter& out, const Record& record) {
  McapOut content;
  fields(content, record);
  const auto bytes = content.release();
  out.u8(static_cast<std::uint8_t>(Record::kOpcode));
  out.u64(bytes.size());
  out.bytes(bytes);
}

void put_mcap_message(ByteWriter& out, const McapMessage& message,
                      std::span<const std::uint8_t> data) {
  out.u8(static_cast<std::uint8_t>(McapMessage::kOpcode));
  out.u64(kMcapMessageFields_bytes + data.size());
  out.u16(message.channel_id);
  out.u32(message.sequence);
  out.u64(static_cast<std::uint64_t>(message.log_time));
  out.u64(static_cast<std::uint64_t>(message.publish_time));
  out.bytes(data);
}

template void put_mcap(ByteWriter&, const McapHeader&);
template std::optional<McapFooter> parse_mcap(std::span<const std::uint8_t>);
template void put_mcap(ByteWriter&, const McapFooter&);
template std::optional<McapSchema> parse_mcap(std::span<const std::uint8_t>);
template void put_mcap(ByteWriter&, const McapSchema&);
template std::optional<McapChannel> parse_mcap(std::span<const std::uint8_t>);
template void put_mcap(ByteWriter&, const McapChannel&);
template std::optional<McapChunk> parse_mcap(std::span<const std::uint8_t>);
template void put_mcap(ByteWriter&, const McapChunk&);
template std::optional<McapMessageIndex> parse_mcap(std::span<const std::uint8_t>);
template void put_mcap(ByteWriter&, const McapMessageIndex&);
template std::optional<McapChunkIndex> parse_mcap(std::span<const std::uint8_t>);
template void put_mcap(ByteWriter&, const McapChunkIndex&);
template std::optional<McapAttachment> parse_mcap(std::span<const std::uint8_t>);
template void put_mcap(ByteWriter&, const McapAttachment&);
template void put_mcap(ByteWriter&, const McapAttachmentIndex&);
template std::optional<McapStatistics> parse_mcap(std::span<const std::uint8_t>);
template void put_mcap(ByteWriter&, const McapStatistics&);
template void put_mcap(ByteWriter&, const McapSummaryOffset&);
template void put_mcap(ByteWriter&, const McapDataEnd&);

}  // namespace km
