#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "modules/core/stamp.hpp"

namespace km {

/// Records of a bag of ROS 1, version 2.0 (wiki.ros.org/Bags/Format/2.0). A record is a header of
/// named fields and data. The length of each precedes it in four bytes, little endian.
enum class Ros1Opcode : std::uint8_t {
  kMessage = 0x02,
  kBagHeader = 0x03,
  kIndexData = 0x04,
  kChunk = 0x05,
  kChunkInfo = 0x06,
  kConnection = 0x07,
};

/// First bytes of a file.
inline constexpr std::string_view kRos1Magic = "#ROSBAG V2.0\n";

/// The fields of a record's header.
class Ros1Fields {
 public:
  /// nullopt if `bytes` are no such fields. `bytes` must outlive the result.
  [[nodiscard]] static std::optional<Ros1Fields> parse(std::span<const std::uint8_t> bytes);

  /// True if the record is of this kind.
  [[nodiscard]] bool is(Ros1Opcode kind) const;
  // Value of a field; nullopt if there is no field of this name and size.
  [[nodiscard]] std::optional<std::uint32_t> u32(const char* name) const;
  [[nodiscard]] std::optional<std::uint64_t> u64(const char* name) const;
  [[nodiscard]] std::optional<Stamp> time(const char* name) const;
  [[nodiscard]] std::optional<std::string> text(const char* name) const;

 private:
  [[nodiscard]] std::span<const std::uint8_t> field(const char* name, std::size_t size) const;

  std::map<std::string, std::span<const std::uint8_t>, std::less<>> fields_;
};

/// A record in a chunk or index.
struct Ros1Record {
  Ros1Fields fields;
  std::span<const std::uint8_t> data;
  std::uint64_t data_begin = 0;  ///< Position of the data in the parsed bytes.
};

/// Parses the record at `at` and advances `at` behind the record; nullopt if the bytes are no
/// record or end too early.
[[nodiscard]] std::optional<Ros1Record> next_ros1_record(std::span<const std::uint8_t> bytes,
                                                         std::uint64_t& at);

struct Ros1Connection {
  std::uint32_t id = 0;
  std::string topic;
  std::string type;
};

/// Position of a chunk, and its number of messages per connection.
struct Ros1ChunkInfo {
  std::uint64_t begin = 0;  ///< [bytes from the beginning of the file].
  Stamp first = 0;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> counts;
};

[[nodiscard]] std::optional<Ros1Connection> parse_ros1_connection(const Ros1Record& record);
[[nodiscard]] std::optional<Ros1ChunkInfo> parse_ros1_chunk_info(const Ros1Record& record);

}  // namespace km
