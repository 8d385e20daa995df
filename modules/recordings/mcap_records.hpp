#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "modules/core/stamp.hpp"

namespace km {

/// Records of an MCAP file (mcap.dev/spec): an octet that says which, eight that say how many
/// follow, little endian. Fields that come after those known here are left alone, as the
/// specification asks for.
enum class McapOpcode : std::uint8_t {
  kHeader = 0x01,
  kFooter = 0x02,
  kSchema = 0x03,
  kChannel = 0x04,
  kMessage = 0x05,
  kChunk = 0x06,
  kChunkIndex = 0x08,
  kStatistics = 0x0B,
  kDataEnd = 0x0F,
};

/// First and last bytes of a file.
inline constexpr std::string_view kMcapMagic{"\x89MCAP0\r\n", 8};
/// Opcode and length.
inline constexpr std::uint64_t kMcapRecordHeader_bytes = 9;

struct McapRecordHeader {
  std::uint8_t opcode = 0;
  std::uint64_t size = 0;  ///< Of what follows [bytes].

  [[nodiscard]] bool is(McapOpcode kind) const { return opcode == static_cast<std::uint8_t>(kind); }
};

struct McapFooter {
  std::uint64_t summary_start = 0;  ///< [bytes from the beginning of the file]; 0: no summary.
  std::uint64_t summary_offset_start = 0;
  std::uint32_t summary_crc = 0;  ///< 0: none.
};

struct McapSchema {
  std::uint16_t id = 0;
  std::string name;
};

struct McapChannel {
  std::uint16_t id = 0;
  std::uint16_t schema_id = 0;  ///< 0: none.
  std::string topic;
  std::string message_encoding;
};

struct McapMessage {
  std::uint16_t channel_id = 0;
  Stamp log_time = 0;
  std::uint32_t data_size = 0;
};
/// Fields of a message before its data: channel, sequence, log time, publish time.
inline constexpr std::uint64_t kMcapMessageFields_bytes = 2 + 4 + 8 + 8;

/// Of a chunk the fields before its records.
struct McapChunk {
  Stamp message_start_time = 0;
  std::uint64_t uncompressed_size = 0;
  std::uint32_t uncompressed_crc = 0;  ///< 0: none.
  std::string compression;
  std::span<const std::uint8_t> records;  ///< Into what was parsed.
};

struct McapChunkIndex {
  Stamp message_start_time = 0;
  std::uint64_t chunk_start = 0;   ///< [bytes from the beginning of the file].
  std::uint64_t chunk_length = 0;  ///< With opcode and length.
  std::vector<std::uint16_t> channel_ids;
  std::uint64_t message_index_length = 0;  ///< Of the indexes right behind the chunk.
};

struct McapStatistics {
  std::uint64_t message_count = 0;
  std::uint32_t chunk_count = 0;
  std::vector<std::pair<std::uint16_t, std::uint64_t>> channel_message_counts;
};

/// Each takes what follows a record's header; nullopt for bytes that cannot be such a record.
/// Times beyond 2^63 - 1 ns are none.
[[nodiscard]] std::optional<McapRecordHeader> parse_mcap_record_header(
    std::span<const std::uint8_t> bytes);
[[nodiscard]] std::optional<McapFooter> parse_mcap_footer(std::span<const std::uint8_t> bytes);
[[nodiscard]] std::optional<McapSchema> parse_mcap_schema(std::span<const std::uint8_t> bytes);
[[nodiscard]] std::optional<McapChannel> parse_mcap_channel(std::span<const std::uint8_t> bytes);
/// `bytes` may end behind kMcapMessageFields_bytes; `size` is what they are of.
[[nodiscard]] std::optional<McapMessage> parse_mcap_message(std::span<const std::uint8_t> bytes,
                                                            std::uint64_t size);
[[nodiscard]] std::optional<McapChunk> parse_mcap_chunk(std::span<const std::uint8_t> bytes);
[[nodiscard]] std::optional<McapChunkIndex> parse_mcap_chunk_index(
    std::span<const std::uint8_t> bytes);
[[nodiscard]] std::optional<McapStatistics> parse_mcap_statistics(
    std::span<const std::uint8_t> bytes);

}  // namespace km
