#include <algorithm>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <utility>

#include "modules/core/io/bytes.hpp"
#include "modules/core/io/input_file.hpp"
#include "modules/recordings/chunked_file.hpp"
#include "modules/recordings/open_bag.hpp"

namespace km {
namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr std::string_view kRos1Magic = "#ROSBAG V2.0\n";
constexpr std::uint64_t kMaxHeader_bytes = std::uint64_t{1} << 20U;

// A record is a header of named fields and data. The length of each precedes it in four bytes,
// little endian.
enum class Ros1Opcode : std::uint8_t {
  kMessage = 0x02,
  kBagHeader = 0x03,
  kChunk = 0x05,
  kChunkInfo = 0x06,
  kConnection = 0x07,
};

// The fields of a record's header. They refer to the parsed bytes.
class Ros1Fields {
 public:
  // nullopt if `bytes` are no such fields.
  [[nodiscard]] static std::optional<Ros1Fields> parse(std::span<const std::uint8_t> bytes) {
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

  [[nodiscard]] bool is(Ros1Opcode kind) const {
    const auto opcode = field("op", 1);
    return opcode && opcode->front() == static_cast<std::uint8_t>(kind);
  }
  // Value of a field; nullopt if there is no field of this name and size.
  [[nodiscard]] std::optional<std::uint32_t> u32(const char* name) const {
    const auto bytes = field(name, 4);
    return bytes ? std::optional(ByteReader(*bytes).u32()) : std::nullopt;
  }
  [[nodiscard]] std::optional<std::uint64_t> u64(const char* name) const {
    const auto bytes = field(name, 8);
    return bytes ? std::optional(ByteReader(*bytes).u64()) : std::nullopt;
  }
  [[nodiscard]] std::optional<Stamp> time(const char* name) const {
    constexpr Stamp kSecond_ns = 1'000'000'000;
    const auto bytes = field(name, 8);
    if (!bytes) return std::nullopt;
    ByteReader reader(*bytes);
    const Stamp seconds = reader.u32();
    return seconds * kSecond_ns + reader.u32();
  }
  [[nodiscard]] std::optional<std::string> text(std::string_view name) const {
    const auto found = fields_.find(name);
    if (found == fields_.end()) return std::nullopt;
    return std::string(found->second.begin(), found->second.end());
  }

 private:
  [[nodiscard]] std::optional<std::span<const std::uint8_t>> field(std::string_view name,
                                                                   std::size_t size) const {
    const auto found = fields_.find(name);
    if (found == fields_.end() || found->second.size() != size) return std::nullopt;
    return found->second;
  }

  std::map<std::string, std::span<const std::uint8_t>, std::less<>> fields_;
};

// A record in a chunk or index.
struct Ros1Record {
  Ros1Fields fields;
  std::span<const std::uint8_t> data;
  std::uint64_t data_begin = 0;  // position of the data in the parsed bytes
};

// Parses the record at `at` and advances `at` behind the record; nullopt if the bytes are no record
// or end too early.
std::optional<Ros1Record> next_record(std::span<const std::uint8_t> bytes, std::uint64_t& at) {
  ByteReader reader(bytes.subspan(at));
  auto fields = Ros1Fields::parse(reader.bytes(reader.u32()));
  const auto data = reader.bytes(reader.u32());
  if (reader.failed() || !fields || !fields->text("op")) return std::nullopt;
  at = bytes.size() - reader.left();
  return Ros1Record{.fields = *std::move(fields), .data = data, .data_begin = at - data.size()};
}

// Position of a chunk, and its number of messages per connection.
struct Ros1ChunkInfo {
  std::uint64_t begin = 0;  // [bytes from the beginning of the file]
  Stamp first = 0;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> counts = {};
};

std::optional<Ros1ChunkInfo> parse_chunk_info(const Ros1Record& record) {
  constexpr std::size_t kCount_bytes = 8;
  const auto version = record.fields.u32("ver");
  const auto begin = record.fields.u64("chunk_pos");
  const auto first = record.fields.time("start_time");
  const auto count = record.fields.u32("count");
  if (version != 1U || !begin || !first || !count) return std::nullopt;
  if (record.data.size() != *count * std::uint64_t{kCount_bytes}) return std::nullopt;
  Ros1ChunkInfo info{.begin = *begin, .first = *first};
  for (ByteReader reader(record.data); reader.left() > 0;) {
    const std::uint32_t connection = reader.u32();
    info.counts.emplace_back(connection, reader.u32());
  }
  return info;
}

class Ros1BagReader final : public BagReader {
 public:
  explicit Ros1BagReader(const std::filesystem::path& path)
      : chunks_(path, [this](const ChunkRange& place) { return parse(place); }) {
    if (file_.beginning(kRos1Magic.size()) != kRos1Magic)
      throw InputFileError(file_.place(0) + ": does not begin as bags of version 2.0 do");
    const auto header = record_at(kRos1Magic.size(), file_.size());
    if (!header || !header->fields.is(Ros1Opcode::kBagHeader))
      throw InputFileError(file_.place(kRos1Magic.size()) + ": no bag header");
    if (!header->fields.text("encryptor").value_or("").empty())
      throw InputFileError(file_.place(kRos1Magic.size()) + ": the bag is encrypted");
    if (const char* const problem = read_index(*header)) {
      chunks_.fault(BagFault::kIndex, kRos1Magic.size(), problem);
      chunks_.channels = {};
      channel_of_.clear();
      chunks_.places.clear();
      read_all(header->data_begin + header->data_size);
    }
  }

  [[nodiscard]] const std::vector<BagChannel>& channels() const override {
    return chunks_.channels.channels();
  }
  [[nodiscard]] std::optional<BagMessage> next() override { return chunks_.next(); }
  [[nodiscard]] BagReport report() const override { return chunks_.faults(); }

 private:
  // Header of a record, and position of its data in the file.
  struct Place {
    Bytes header;  // bytes to which `fields` refer
    Ros1Fields fields;
    std::uint64_t data_begin = 0;
    std::uint32_t data_size = 0;
  };

  // The record at `begin`; nullopt if there is no record that ends before `end`.
  [[nodiscard]] std::optional<Place> record_at(std::uint64_t begin, std::uint64_t end) const {
    constexpr std::uint64_t kLength_bytes = 4;
    // The length at `at`, if as many bytes follow.
    const auto length_at = [&](std::uint64_t at) -> std::optional<std::uint32_t> {
      if (end < kLength_bytes || at > end - kLength_bytes) return std::nullopt;
      const std::uint32_t length = ByteReader(file_.read(at, kLength_bytes)).u32();
      return length <= end - at - kLength_bytes ? std::optional(length) : std::nullopt;
    };
    const auto header_size = length_at(begin);
    if (!header_size || *header_size > kMaxHeader_bytes) return std::nullopt;
    const std::uint64_t header_end = begin + kLength_bytes + *header_size;
    const auto data_size = length_at(header_end);
    if (!data_size) return std::nullopt;
    Place place{.header = file_.read(begin + kLength_bytes, *header_size),
                .fields = {},
                .data_begin = header_end + kLength_bytes,
                .data_size = *data_size};
    auto fields = Ros1Fields::parse(place.header);
    if (!fields) return std::nullopt;
    place.fields = *std::move(fields);
    return place;
  }

  // Reason why the index cannot be used, or null.
  [[nodiscard]] const char* read_index(const Place& bag_header) {
    const auto begin = bag_header.fields.u64("index_pos");
    const auto connections = bag_header.fields.u32("conn_count");
    const auto chunks = bag_header.fields.u32("chunk_count");
    const std::uint64_t data_begin = bag_header.data_begin + bag_header.data_size;
    if (!begin || !connections || !chunks) return "a bag header that lacks fields";
    if (*begin == 0) return "the bag was not closed: no index";
    if (*begin < data_begin || *begin > file_.size()) return "an index outside of the file";
    if (file_.size() - *begin > kMaxDecompressed_bytes) return "an index of more than 512 MiB";
    const Bytes bytes = file_.read(*begin, file_.size() - *begin);
    std::vector<Ros1ChunkInfo> infos;
    std::size_t found = 0;
    for (std::uint64_t at = 0; at < bytes.size();) {
      const std::uint64_t place = *begin + at;
      const auto record = next_record(bytes, at);
      if (!record) return "an index with an invalid record";
      if (record->fields.is(Ros1Opcode::kConnection)) {
        add_connection(*record, place);
        ++found;
      } else if (record->fields.is(Ros1Opcode::kChunkInfo)) {
        const auto info = parse_chunk_info(*record);
        if (!info) return "an index with an invalid chunk info";
        infos.push_back(*info);
      }
    }
    if (found != *connections || infos.size() != *chunks)
      return "an index with another number of connections or chunks than the bag header states";
    return use_chunk_infos(std::move(infos), data_begin, *begin);
  }

  [[nodiscard]] const char* use_chunk_infos(std::vector<Ros1ChunkInfo> infos, std::uint64_t begin,
                                            std::uint64_t end) {
    std::ranges::sort(infos, {}, &Ros1ChunkInfo::begin);
    for (std::size_t i = 0; i < infos.size(); ++i) {
      const std::uint64_t next = i + 1 < infos.size() ? infos[i + 1].begin : end;
      if (infos[i].begin < begin || infos[i].begin >= next) return "chunks outside of the data";
      chunks_.places.push_back({.begin = infos[i].begin, .end = next, .first = infos[i].first});
      for (const auto& [connection, count] : infos[i].counts) {
        const auto channel = channel_of_.find(connection);
        if (channel == channel_of_.end())
          return "messages of a connection that it does not describe";
        chunks_.channels.at(channel->second).message_count += count;
      }
    }
    return nullptr;
  }

  void read_all(std::uint64_t begin) {
    const std::uint64_t end = file_.size();
    for (std::uint64_t at = begin; at < end;) {
      const auto record = record_at(at, end);
      if (!record) return chunks_.fault(BagFault::kTruncated, at, "a truncated or invalid record");
      const std::uint64_t next = record->data_begin + record->data_size;
      if (record->fields.is(Ros1Opcode::kChunk)) chunks_.scan(at, next);
      at = next;
    }
  }

  [[nodiscard]] Chunk parse(const ChunkRange& place) {
    Chunk chunk{.bytes = records_of(place), .entries = {}};
    for (std::uint64_t at = 0; at < chunk.bytes.size();) {
      const auto record = next_record(chunk.bytes, at);
      if (!record) {
        chunks_.fault(BagFault::kMalformed, place.begin, "a chunk with an invalid record");
        break;
      }
      if (record->fields.is(Ros1Opcode::kConnection))
        add_connection(*record, place.begin);
      else if (record->fields.is(Ros1Opcode::kMessage))
        add_entry(*record, place.begin, chunk);
    }
    return chunk;
  }

  // The uncompressed records of a chunk; empty if they cannot be read.
  [[nodiscard]] Bytes records_of(const ChunkRange& place) {
    const auto refuse = [&](BagFault fault, const std::string& why) {
      chunks_.fault(fault, place.begin, why);
      return Bytes{};
    };
    const auto record = record_at(place.begin, place.end);
    if (!record || !record->fields.is(Ros1Opcode::kChunk))
      return refuse(BagFault::kIndex, "no chunk at the position in the index, or one that is cut");
    const auto compression = record->fields.text("compression");
    const auto size = record->fields.u32("size");
    if (!compression || !size || record->data_size > kMaxDecompressed_bytes)
      return refuse(BagFault::kMalformed, "a chunk that lacks fields, or of more than 512 MiB");
    return chunks_.unpack(place.begin, *compression,
                          file_.read(record->data_begin, record->data_size), *size);
  }

  void add_connection(const Ros1Record& record, std::uint64_t place) {
    const auto id = record.fields.u32("conn");
    const auto topic = record.fields.text("topic");
    const auto description = Ros1Fields::parse(record.data);
    const auto type = description ? description->text("type") : std::nullopt;
    if (!id || !topic || !type)
      return chunks_.fault(BagFault::kMalformed, place, "an invalid connection");
    if (channel_of_.contains(*id)) return;
    channel_of_[*id] = chunks_.channels.add({.topic = *topic, .type = *type, .encoding = "ros1"});
  }

  void add_entry(const Ros1Record& record, std::uint64_t place, Chunk& chunk) {
    const auto connection = record.fields.u32("conn");
    const auto time = record.fields.time("time");
    if (!connection || !time)
      return chunks_.fault(BagFault::kMalformed, place, "an invalid message");
    const auto channel = channel_of_.find(*connection);
    if (channel == channel_of_.end())
      return chunks_.fault(BagFault::kUnknownChannel, place,
                           "connection " + std::to_string(*connection));
    chunk.entries.push_back({.log_time = *time,
                             .channel = static_cast<std::uint32_t>(channel->second),
                             .size = static_cast<std::uint32_t>(record.data.size()),
                             .begin = record.data_begin});
  }

  ChunkedFile chunks_;
  const RandomAccessFile& file_ = chunks_.file;
  std::map<std::uint32_t, std::size_t> channel_of_;  // channel of each connection of the bag
};

}  // namespace

std::unique_ptr<BagReader> open_ros1_bag(const std::filesystem::path& path) {
  return std::make_unique<Ros1BagReader>(path);
}

}  // namespace km
