#include "modules/recordings/mcap_records.hpp"

#include <limits>

#include "modules/core/bytes.hpp"

namespace km {
namespace {

constexpr auto kLatest = static_cast<std::uint64_t>(std::numeric_limits<Stamp>::max());

std::string read_string(ByteReader& reader) {
  const auto bytes = reader.bytes(reader.u32());
  return {bytes.begin(), bytes.end()};
}

Stamp read_time(ByteReader& reader) {
  const std::uint64_t time = reader.u64();
  return static_cast<Stamp>(time <= kLatest ? time : reader.fail());
}

// A map from channel to a number, of which the length in bytes comes first.
std::vector<std::pair<std::uint16_t, std::uint64_t>> read_map(ByteReader& reader) {
  constexpr std::size_t kPair_bytes = 10;
  ByteReader pairs(reader.bytes(reader.u32()));
  std::vector<std::pair<std::uint16_t, std::uint64_t>> map;
  map.reserve(pairs.left() / kPair_bytes);
  while (pairs.left() > 0) {
    const std::uint16_t channel = pairs.u16();
    map.emplace_back(channel, pairs.u64());
  }
  if (pairs.failed()) reader.fail();
  return map;
}

template <typename T>
std::optional<T> checked(const ByteReader& reader, T record) {
  return reader.failed() ? std::nullopt : std::optional(std::move(record));
}

}  // namespace

std::optional<McapRecordHeader> parse_mcap_record_header(std::span<const std::uint8_t> bytes) {
  ByteReader reader(bytes);
  McapRecordHeader header;
  header.opcode = reader.u8();
  header.size = reader.u64();
  if (header.opcode == 0) reader.fail();
  return checked(reader, header);
}

std::optional<McapFooter> parse_mcap_footer(std::span<const std::uint8_t> bytes) {
  ByteReader reader(bytes);
  McapFooter footer;
  footer.summary_start = reader.u64();
  footer.summary_offset_start = reader.u64();
  footer.summary_crc = reader.u32();
  return checked(reader, footer);
}

std::optional<McapSchema> parse_mcap_schema(std::span<const std::uint8_t> bytes) {
  ByteReader reader(bytes);
  McapSchema schema;
  schema.id = reader.u16();
  schema.name = read_string(reader);
  if (schema.id == 0) reader.fail();
  return checked(reader, std::move(schema));
}

std::optional<McapChannel> parse_mcap_channel(std::span<const std::uint8_t> bytes) {
  ByteReader reader(bytes);
  McapChannel channel;
  channel.id = reader.u16();
  channel.schema_id = reader.u16();
  channel.topic = read_string(reader);
  channel.message_encoding = read_string(reader);
  return checked(reader, std::move(channel));
}

std::optional<McapMessage> parse_mcap_message(std::span<const std::uint8_t> bytes,
                                              std::uint64_t size) {
  ByteReader reader(bytes);
  McapMessage message;
  message.channel_id = reader.u16();
  static_cast<void>(reader.u32());  // sequence
  message.log_time = read_time(reader);
  static_cast<void>(reader.u64());  // publish time
  if (reader.failed() ||
      size - kMcapMessageFields_bytes > std::numeric_limits<std::uint32_t>::max())
    return std::nullopt;
  message.data_size = static_cast<std::uint32_t>(size - kMcapMessageFields_bytes);
  return message;
}

std::optional<McapChunk> parse_mcap_chunk(std::span<const std::uint8_t> bytes) {
  ByteReader reader(bytes);
  McapChunk chunk;
  chunk.message_start_time = read_time(reader);
  static_cast<void>(reader.u64());  // end
  chunk.uncompressed_size = reader.u64();
  chunk.uncompressed_crc = reader.u32();
  chunk.compression = read_string(reader);
  chunk.records = reader.bytes(reader.u64());
  return checked(reader, std::move(chunk));
}

std::optional<McapChunkIndex> parse_mcap_chunk_index(std::span<const std::uint8_t> bytes) {
  ByteReader reader(bytes);
  McapChunkIndex index;
  index.message_start_time = read_time(reader);
  static_cast<void>(reader.u64());  // end
  index.chunk_start = reader.u64();
  index.chunk_length = reader.u64();
  for (const auto& [channel, offset] : read_map(reader)) index.channel_ids.push_back(channel);
  index.message_index_length = reader.u64();
  return checked(reader, std::move(index));
}

std::optional<McapStatistics> parse_mcap_statistics(std::span<const std::uint8_t> bytes) {
  ByteReader reader(bytes);
  McapStatistics statistics;
  statistics.message_count = reader.u64();
  static_cast<void>(reader.u16());  // schemas
  static_cast<void>(reader.u32());  // channels
  static_cast<void>(reader.u32());  // attachments
  static_cast<void>(reader.u32());  // metadata
  statistics.chunk_count = reader.u32();
  static_cast<void>(reader.u64());  // first time
  static_cast<void>(reader.u64());  // last time
  statistics.channel_message_counts = read_map(reader);
  return checked(reader, std::move(statistics));
}

}  // namespace km
