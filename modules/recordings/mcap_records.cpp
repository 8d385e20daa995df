#include "modules/recordings/mcap_records.hpp"

#include <zlib.h>

#include <limits>

namespace km {

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

std::optional<McapMessage> parse_mcap_message(std::span<const std::uint8_t> bytes,
                                              std::uint64_t size) {
  ByteReader reader(bytes);
  McapMessage message;
  message.channel_id = reader.u16();
  message.sequence = reader.u32();
  const std::uint64_t log_time = reader.u64();
  message.log_time = static_cast<Stamp>(log_time);
  message.publish_time = static_cast<Stamp>(reader.u64());  // not checked, because it is not used
  if (reader.failed() || log_time > kMcapLatest ||
      size - kMcapMessageFields_bytes > std::numeric_limits<std::uint32_t>::max())
    return std::nullopt;
  message.data_size = static_cast<std::uint32_t>(size - kMcapMessageFields_bytes);
  return message;
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

}  // namespace km
