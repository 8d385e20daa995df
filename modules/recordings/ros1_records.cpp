#include "modules/recordings/ros1_records.hpp"

#include <algorithm>
#include <functional>

#include "modules/core/bytes.hpp"

namespace km {

std::optional<Ros1Fields> Ros1Fields::parse(std::span<const std::uint8_t> bytes) {
  Ros1Fields parsed;
  ByteReader reader(bytes);
  while (reader.left() > 0) {
    const auto field = reader.bytes(reader.u32());
    const auto equals = std::find(field.begin(), field.end(), std::uint8_t{'='});
    if (equals == field.end()) return std::nullopt;
    const auto name_size = static_cast<std::size_t>(equals - field.begin());
    parsed.fields_.try_emplace(std::string(field.begin(), equals), field.subspan(name_size + 1));
  }
  return reader.failed() ? std::nullopt : std::optional(std::move(parsed));
}

// Value of a field; empty if there is no field of this name and size.
std::span<const std::uint8_t> Ros1Fields::field(const char* name, std::size_t size) const {
  const auto found = fields_.find(std::string_view(name));
  if (found == fields_.end() || found->second.size() != size) return {};
  return found->second;
}

bool Ros1Fields::is(Ros1Opcode kind) const {
  const auto opcode = field("op", 1);
  return !opcode.empty() && opcode[0] == static_cast<std::uint8_t>(kind);
}

std::optional<std::uint32_t> Ros1Fields::u32(const char* name) const {
  const auto bytes = field(name, 4);
  return bytes.empty() ? std::nullopt : std::optional(ByteReader(bytes).u32());
}

std::optional<std::uint64_t> Ros1Fields::u64(const char* name) const {
  const auto bytes = field(name, 8);
  return bytes.empty() ? std::nullopt : std::optional(ByteReader(bytes).u64());
}

std::optional<Stamp> Ros1Fields::time(const char* name) const {
  constexpr Stamp kSecond_ns = 1'000'000'000;
  const auto bytes = field(name, 8);
  if (bytes.empty()) return std::nullopt;
  ByteReader reader(bytes);
  const Stamp seconds = reader.u32();
  return seconds * kSecond_ns + reader.u32();
}

std::optional<std::string> Ros1Fields::text(const char* name) const {
  const auto found = fields_.find(std::string_view(name));
  if (found == fields_.end()) return std::nullopt;
  return std::string(found->second.begin(), found->second.end());
}

std::optional<Ros1Record> next_ros1_record(std::span<const std::uint8_t> bytes, std::uint64_t& at) {
  ByteReader reader(bytes.subspan(at));
  auto fields = Ros1Fields::parse(reader.bytes(reader.u32()));
  const auto data = reader.bytes(reader.u32());
  if (reader.failed() || !fields || !fields->text("op")) return std::nullopt;
  at = bytes.size() - reader.left();
  return Ros1Record{.fields = *std::move(fields), .data = data, .data_begin = at - data.size()};
}

std::optional<Ros1Connection> parse_ros1_connection(const Ros1Record& record) {
  const auto id = record.fields.u32("conn");
  auto topic = record.fields.text("topic");
  const auto description = Ros1Fields::parse(record.data);
  if (!id || !topic || !description) return std::nullopt;
  auto type = description->text("type");
  if (!type) return std::nullopt;
  return Ros1Connection{.id = *id, .topic = *std::move(topic), .type = *std::move(type)};
}

std::optional<Ros1ChunkInfo> parse_ros1_chunk_info(const Ros1Record& record) {
  constexpr std::size_t kCount_bytes = 8;
  const auto version = record.fields.u32("ver");
  const auto begin = record.fields.u64("chunk_pos");
  const auto first = record.fields.time("start_time");
  const auto count = record.fields.u32("count");
  if (version != 1U || !begin || !first || !count) return std::nullopt;
  if (record.data.size() != *count * std::uint64_t{kCount_bytes}) return std::nullopt;
  Ros1ChunkInfo info{.begin = *begin, .first = *first, .counts = {}};
  for (ByteReader reader(record.data); reader.left() > 0;) {
    const std::uint32_t connection = reader.u32();
    info.counts.emplace_back(connection, reader.u32());
  }
  return info;
}

}  // namespace km
