#include "modules/recordings/ros1_bag_reader.hpp"

#include <algorithm>
#include <string>
#include <utility>

#include "modules/core/bytes.hpp"
#include "modules/core/input_file.hpp"

namespace km {
namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr std::uint64_t kMaxHeader_bytes = std::uint64_t{1} << 20U;

}  // namespace

Ros1BagReader::Ros1BagReader(const std::filesystem::path& path) : file_(path) {
  if (file_.beginning(kRos1Magic.size()) != kRos1Magic)
    throw InputFileError(file_.place(0) + ": does not begin as bags of version 2.0 do");
  const auto header = record_at(kRos1Magic.size(), file_.size());
  if (!header || !header->fields.is(Ros1Opcode::kBagHeader))
    throw InputFileError(file_.place(kRos1Magic.size()) + ": no bag header");
  if (!header->fields.text("encryptor").value_or("").empty())
    throw InputFileError(file_.place(kRos1Magic.size()) + ": the bag is encrypted");
  if (const char* const problem = read_index(*header)) {
    report_.add(BagFault::kIndex, kRos1Magic.size(), problem);
    channels_ = {};
    channel_of_.clear();
    places_.clear();
    read_all(header->data_begin + header->data_size);
  }
  merge_ = std::make_unique<ChunkMerge>(
      std::move(places_), [this](const ChunkRange& place) { return load(place); },
      [this](const ChunkRange& place, const Chunk::Entry& entry) {
        report_.add(BagFault::kUnordered, place.begin, channels()[entry.channel].topic);
      });
}

std::optional<Ros1BagReader::Place> Ros1BagReader::record_at(std::uint64_t begin,
                                                             std::uint64_t end) const {
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

const char* Ros1BagReader::read_index(const Place& bag_header) {
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
    const auto record = next_ros1_record(bytes, at);
    if (!record) return "an index with an invalid record";
    if (record->fields.is(Ros1Opcode::kConnection)) {
      add_connection(*record, place);
      ++found;
    } else if (record->fields.is(Ros1Opcode::kChunkInfo)) {
      const auto info = parse_ros1_chunk_info(*record);
      if (!info) return "an index with an invalid chunk info";
      infos.push_back(*info);
    }
  }
  if (found != *connections || infos.size() != *chunks)
    return "an index with another number of connections or chunks than the bag header states";
  return use_chunk_infos(std::move(infos), data_begin, *begin);
}

const char* Ros1BagReader::use_chunk_infos(std::vector<Ros1ChunkInfo> infos, std::uint64_t begin,
                                           std::uint64_t end) {
  std::sort(infos.begin(), infos.end(),
            [](const auto& a, const auto& b) { return a.begin < b.begin; });
  for (std::size_t i = 0; i < infos.size(); ++i) {
    const std::uint64_t next = i + 1 < infos.size() ? infos[i + 1].begin : end;
    if (infos[i].begin < begin || infos[i].begin >= next) return "chunks outside of the data";
    places_.push_back({.begin = infos[i].begin, .end = next, .first = infos[i].first});
    for (const auto& [connection, count] : infos[i].counts) {
      const auto channel = channel_of_.find(connection);
      if (channel == channel_of_.end()) return "messages of a connection that it does not describe";
      channels_.add_messages(channel->second, count);
    }
  }
  return nullptr;
}

void Ros1BagReader::read_all(std::uint64_t begin) {
  const std::uint64_t end = file_.size();
  for (std::uint64_t at = begin; at < end;) {
    const auto record = record_at(at, end);
    if (!record) return report_.add(BagFault::kTruncated, at, "a truncated or invalid record");
    const std::uint64_t next = record->data_begin + record->data_size;
    if (record->fields.is(Ros1Opcode::kChunk)) note_chunk(at, next);
    at = next;
  }
}

void Ros1BagReader::note_chunk(std::uint64_t begin, std::uint64_t end) {
  ChunkRange place{.begin = begin, .end = end};
  const Chunk chunk = load(place);
  if (chunk.entries.empty()) return;
  place.first = chunk.entries.front().log_time;
  for (const Chunk::Entry& entry : chunk.entries) {
    place.first = std::min(place.first, entry.log_time);
    channels_.add_messages(entry.channel, 1);
  }
  places_.push_back(place);
}

Chunk Ros1BagReader::load(const ChunkRange& place) {
  report_.begin_chunk(place.begin);
  Chunk chunk{.bytes = records_of(place), .entries = {}};
  for (std::uint64_t at = 0; at < chunk.bytes.size();) {
    const auto record = next_ros1_record(chunk.bytes, at);
    if (!record) {
      report_.add(BagFault::kMalformed, place.begin, "a chunk with an invalid record");
      break;
    }
    if (record->fields.is(Ros1Opcode::kConnection))
      add_connection(*record, place.begin);
    else if (record->fields.is(Ros1Opcode::kMessage))
      add_entry(*record, place.begin, chunk);
  }
  report_.end_chunk();
  return chunk;
}

// The uncompressed records of a chunk; empty if they cannot be read.
Bytes Ros1BagReader::records_of(const ChunkRange& place) {
  const auto refuse = [&](BagFault fault, const std::string& why) {
    report_.add(fault, place.begin, why);
    return Bytes{};
  };
  const auto record = record_at(place.begin, place.end);
  if (!record || !record->fields.is(Ros1Opcode::kChunk))
    return refuse(BagFault::kIndex, "no chunk at the position in the index, or one that is cut");
  const auto compression = record->fields.text("compression");
  const auto size = record->fields.u32("size");
  if (!compression || !size || record->data_size > kMaxDecompressed_bytes)
    return refuse(BagFault::kMalformed, "a chunk that lacks fields, or of more than 512 MiB");
  if (!unpack_limit_.accept(place.begin, *size))
    return refuse(BagFault::kCompression,
                  "a chunk of " + std::to_string(*size) + " bytes: " + UnpackLimit::kRefusal);
  auto records = decompress(*compression, file_.read(record->data_begin, record->data_size), *size);
  if (!records.value)
    return refuse(BagFault::kCompression,
                  "a chunk (compression '" + *compression + "'): " + records.refusal);
  return *std::move(records.value);
}

void Ros1BagReader::add_connection(const Ros1Record& record, std::uint64_t place) {
  const auto connection = parse_ros1_connection(record);
  if (!connection) return report_.add(BagFault::kMalformed, place, "an invalid connection");
  if (channel_of_.contains(connection->id)) return;
  channel_of_[connection->id] =
      channels_.add({.topic = connection->topic, .type = connection->type, .encoding = "ros1"});
}

void Ros1BagReader::add_entry(const Ros1Record& record, std::uint64_t place, Chunk& chunk) {
  const auto connection = record.fields.u32("conn");
  const auto time = record.fields.time("time");
  if (!connection || !time) return report_.add(BagFault::kMalformed, place, "an invalid message");
  const auto channel = channel_of_.find(*connection);
  if (channel == channel_of_.end())
    return report_.add(BagFault::kUnknownChannel, place,
                       "connection " + std::to_string(*connection));
  chunk.entries.push_back({.log_time = *time,
                           .channel = static_cast<std::uint32_t>(channel->second),
                           .size = static_cast<std::uint32_t>(record.data.size()),
                           .begin = record.data_begin});
}

}  // namespace km
