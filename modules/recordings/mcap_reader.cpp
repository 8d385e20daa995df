#include "modules/recordings/mcap_reader.hpp"

#include <algorithm>
#include <utility>

#include "modules/core/bytes.hpp"
#include "modules/core/input_file.hpp"

namespace km {
namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr std::uint64_t kFooter_bytes = kMcapRecordHeader_bytes + kMcapFooterFields_bytes;
constexpr std::uint64_t kMaxDefinition_bytes = std::uint64_t{64} << 20U;
// Largest size of a part of messages outside of chunks.
constexpr std::uint64_t kBarePart_bytes = std::uint64_t{4} << 20U;

struct McapRecord {
  McapRecordHeader header;
  std::span<const std::uint8_t> content;
  std::uint64_t begin = 0;  // position of the content in the bytes that were read
};

// Calls `use` with each record; false if the bytes end within a record, or contain an invalid one.
template <typename Use>
bool for_each_record(std::span<const std::uint8_t> bytes, const Use& use) {
  for (std::uint64_t at = 0; at < bytes.size();) {
    const auto header = parse_mcap_record_header(bytes.subspan(at));
    if (!header || header->size > bytes.size() - at - kMcapRecordHeader_bytes) return false;
    at += kMcapRecordHeader_bytes;
    use(McapRecord{.header = *header, .content = bytes.subspan(at, header->size), .begin = at});
    at += header->size;
  }
  return true;
}

void check_magic(const RandomAccessFile& file) {
  if (file.beginning(kMcapMagic.size()) != kMcapMagic)
    throw InputFileError(file.place(0) + ": does not begin as MCAP files of version 0 do");
}

}  // namespace

McapReader::McapReader(const std::filesystem::path& path) : file_(path) {
  check_magic(file_);
  const std::uint64_t data_end = find_data_end();
  const bool has_end = data_end < file_.size();
  std::uint64_t at = kMcapMagic.size();
  if (summary_) {
    use_summary();
    for (const McapChunkIndex& chunk : summary_->chunks) {
      walk(at, chunk.chunk_start, true);
      at = chunk.chunk_start + chunk.chunk_length + chunk.message_index_length;
    }
  }
  walk(at, data_end, has_end);
  merge_ = std::make_unique<ChunkMerge>(
      std::move(places_), [this](const ChunkRange& place) { return load(place); },
      [this](const ChunkRange& place, const Chunk::Entry& entry) {
        report_.add(BagFault::kUnordered, place.begin, channels_[entry.channel].topic);
      });
}

std::uint64_t McapReader::find_data_end() {
  const std::uint64_t size = file_.size();
  const std::uint64_t tail = kFooter_bytes + kMcapMagic.size();
  if (size < kMcapMagic.size() + tail) {
    report_.add(BagFault::kTruncated, size, "the file has no end");
    return size;
  }
  const std::uint64_t begin = size - tail;
  const Bytes bytes = file_.read(begin, tail);
  const bool ends = std::string(bytes.end() - kMcapMagic.size(), bytes.end()) == kMcapMagic;
  const auto header = parse_mcap_record_header(bytes);
  const auto footer = parse_mcap<McapFooter>(
      std::span(bytes).subspan(kMcapRecordHeader_bytes, kMcapFooterFields_bytes));
  if (!ends || !header || !header->is(McapOpcode::kFooter) || !footer) {
    report_.add(BagFault::kTruncated, size, "the file has no end");
    return size;
  }
  if (footer->summary_start == 0) return begin;
  if (footer->summary_start < kMcapMagic.size() || footer->summary_start > begin) {
    report_.add(BagFault::kIndex, begin, "a summary outside of the file");
    return begin;
  }
  read_summary(footer->summary_start, begin, *footer);
  return footer->summary_start;
}

void McapReader::read_summary(std::uint64_t begin, std::uint64_t footer, const McapFooter& fields) {
  // The checksum covers the summary and the fields of the footer before the checksum.
  const std::uint64_t end = footer + kFooter_bytes - sizeof(fields.summary_crc);
  if (end - begin > kMaxDecompressed_bytes)
    return report_.add(BagFault::kIndex, begin, "a summary of more than 512 MiB");
  const Bytes bytes = file_.read(begin, end - begin);
  if (fields.summary_crc != 0 && mcap_crc(bytes) != fields.summary_crc)
    return report_.add(BagFault::kIndex, begin, "a summary with another checksum than it states");
  Summary summary;
  bool is_whole = true;
  is_whole &= for_each_record(std::span(bytes).first(footer - begin), [&](const McapRecord& read) {
    if (read.header.is(McapOpcode::kChunkIndex)) {
      const auto index = parse_mcap<McapChunkIndex>(read.content);
      is_whole &= index.has_value();
      if (index) summary.chunks.push_back(*index);
    } else if (read.header.is(McapOpcode::kStatistics)) {
      summary.statistics = parse_mcap<McapStatistics>(read.content);
      is_whole &= summary.statistics.has_value();
    } else {
      add_definition(read.header, read.content, begin + read.begin);
    }
  });
  const char* const misfit =
      is_whole ? misfit_of(summary, begin) : "a summary with an invalid record";
  if (misfit != nullptr) {
    schemas_.clear();
    channel_of_.clear();
    channels_.clear();
    return report_.add(BagFault::kIndex, begin, misfit);
  }
  if (describes_all(summary)) summary_ = std::move(summary);
}

// The reason why the summary does not fit this file, or null. Sorts the chunks of the summary by
// position.
const char* McapReader::misfit_of(Summary& summary, std::uint64_t data_end) const {
  std::sort(summary.chunks.begin(), summary.chunks.end(),
            [](const auto& a, const auto& b) { return a.chunk_start < b.chunk_start; });
  std::uint64_t at = kMcapMagic.size();
  for (const McapChunkIndex& chunk : summary.chunks) {
    if (chunk.chunk_start < at || chunk.chunk_start > data_end)
      return "chunks that overlap or lie outside of the data";
    at = chunk.chunk_start;
    for (const std::uint64_t length : {chunk.chunk_length, chunk.message_index_length}) {
      if (length > data_end - at) return "a chunk that reaches behind the data";
      at += length;
    }
  }
  const bool counts_others = summary.statistics && !summary.chunks.empty() &&
                             summary.statistics->chunk_count != summary.chunks.size();
  return counts_others ? "another number of chunks than it states" : nullptr;
}

// True if the summary lists all channels with their schemas and all chunks, which the specification
// does not demand.
bool McapReader::describes_all(const Summary& summary) const {
  if (summary.chunks.empty() || !summary.statistics) return false;
  const auto is_known = [&](std::uint16_t id) {
    const auto channel = channel_of_.find(id);
    return channel != channel_of_.end() && !channels_[channel->second].type.empty();
  };
  for (const auto& [channel, count] : summary.statistics->channel_message_counts)
    if (!is_known(channel)) return false;
  for (const McapChunkIndex& chunk : summary.chunks)
    for (const auto& [channel, offset] : chunk.message_index_offsets)
      if (!is_known(channel)) return false;
  return !summary.statistics->channel_message_counts.empty();
}

void McapReader::use_summary() {
  for (BagChannel& channel : channels_) channel.message_count = 0;
  for (const auto& [channel, count] : summary_->statistics->channel_message_counts)
    channels_[channel_of_.at(channel)].message_count = count;
  for (const McapChunkIndex& chunk : summary_->chunks)
    places_.push_back({.begin = chunk.chunk_start,
                       .end = chunk.chunk_start + chunk.chunk_length,
                       .first = chunk.message_start_time});
}

void McapReader::walk(std::uint64_t begin, std::uint64_t end, bool has_end) {
  bool has_bare = false;
  for (std::uint64_t at = begin; at < end;) {
    const Bytes bytes = file_.read(at, std::min(end - at, kMcapRecordHeader_bytes));
    const auto header = parse_mcap_record_header(bytes);
    const std::uint64_t content = at + kMcapRecordHeader_bytes;
    if (bytes.size() == kMcapRecordHeader_bytes && !header)
      return report_.add(BagFault::kMalformed, at, "an invalid record");
    if (!header || header->size > end - content)
      return report_.add(has_end ? BagFault::kMalformed : BagFault::kTruncated, at,
                         "a record that reaches behind the end of the data");
    const std::uint64_t next = content + header->size;
    if (header->is(McapOpcode::kSchema) || header->is(McapOpcode::kChannel)) {
      if (header->size > kMaxDefinition_bytes)
        report_.add(BagFault::kMalformed, at, "a description of more than 64 MiB");
      else
        add_definition(*header, file_.read(content, header->size), at);
    } else if (header->is(McapOpcode::kMessage)) {
      note_bare_message(at, next);
      has_bare = true;
    } else if (header->is(McapOpcode::kChunk)) {
      note_chunk(at, next);
    } else if (header->is(McapOpcode::kDataEnd) || header->is(McapOpcode::kFooter)) {
      if (has_end && next != end)
        report_.add(BagFault::kMalformed, at, "an invalid end of the data");
      if (has_bare && header->is(McapOpcode::kDataEnd) && header->size == 4) {
        const Bytes crc = file_.read(content, 4);
        check_data_crc(at, ByteReader(crc).u32());
      }
      if (!has_end) return;
    }
    at = next;
  }
}

// Adds a message outside of chunks to the former part if no chunk lies between the two.
void McapReader::note_bare_message(std::uint64_t begin, std::uint64_t end) {
  const std::uint64_t content = begin + kMcapRecordHeader_bytes;
  const std::uint64_t size = end - content;
  const Bytes fields = file_.read(content, std::min(size, kMcapMessageFields_bytes));
  const auto message = parse_mcap_message(fields, size);
  if (!message) return report_.add(BagFault::kMalformed, begin, "an invalid message");
  if (size > kMaxDecompressed_bytes)
    return report_.add(BagFault::kMalformed, begin, "a message of more than 512 MiB");
  const auto channel = channel_of_.find(message->channel_id);
  if (channel != channel_of_.end() && !summary_) ++channels_[channel->second].message_count;
  const bool joins = !places_.empty() && places_.back().is_bare && places_.back().end <= begin &&
                     end - places_.back().begin <= kBarePart_bytes;
  if (!joins)
    places_.push_back({.begin = begin, .end = begin, .first = message->log_time, .is_bare = true});
  places_.back().end = end;
  places_.back().first = std::min(places_.back().first, message->log_time);
}

void McapReader::note_chunk(std::uint64_t begin, std::uint64_t end) {
  ChunkRange place{.begin = begin, .end = end};
  const Chunk chunk = load(place);
  if (chunk.entries.empty()) return;
  place.first = chunk.entries.front().log_time;
  for (const Chunk::Entry& entry : chunk.entries) {
    place.first = std::min(place.first, entry.log_time);
    if (!summary_) ++channels_[entry.channel].message_count;
  }
  places_.push_back(place);
}

void McapReader::check_data_crc(std::uint64_t end, std::uint32_t crc) {
  constexpr std::uint64_t kPart_bytes = std::uint64_t{1} << 20U;
  if (crc == 0) return;
  std::uint32_t actual = 0;
  for (std::uint64_t at = 0; at < end; at += kPart_bytes)
    actual = mcap_crc(file_.read(at, std::min(kPart_bytes, end - at)), actual);
  if (actual != crc)
    report_.add(BagFault::kChecksum, end, "the data section has another checksum than it states");
}

Chunk McapReader::load(const ChunkRange& place) {
  report_.begin_chunk(place.begin);
  Chunk chunk{.bytes = records_of(place), .entries = {}};
  const bool is_whole = for_each_record(chunk.bytes, [&](const McapRecord& read) {
    if (!read.header.is(McapOpcode::kMessage)) {
      // walk() has read the records between messages outside of chunks.
      if (!place.is_bare) add_definition(read.header, read.content, place.begin);
      return;
    }
    const auto message = parse_mcap_message(read.content, read.content.size());
    if (!message) return report_.add(BagFault::kMalformed, place.begin, "an invalid message");
    const auto channel = channel_of_.find(message->channel_id);
    if (channel == channel_of_.end())
      return report_.add(BagFault::kUnknownChannel, place.begin,
                         "channel " + std::to_string(message->channel_id));
    chunk.entries.push_back({.log_time = message->log_time,
                             .channel = static_cast<std::uint32_t>(channel->second),
                             .size = message->data_size,
                             .begin = read.begin + kMcapMessageFields_bytes});
  });
  if (!is_whole) report_.add(BagFault::kMalformed, place.begin, "a chunk with an invalid record");
  report_.end_chunk();
  return chunk;
}

// The uncompressed records of a part; empty if they cannot be read.
Bytes McapReader::records_of(const ChunkRange& place) {
  const auto refuse = [&](BagFault fault, const std::string& why) {
    report_.add(fault, place.begin, why);
    return Bytes{};
  };
  const std::uint64_t size = place.end - place.begin;
  if (size > kMaxDecompressed_bytes)
    return refuse(BagFault::kMalformed, "a chunk of more than 512 MiB");
  Bytes bytes = file_.read(place.begin, size);
  if (place.is_bare) return bytes;
  const auto header = parse_mcap_record_header(bytes);
  if (!header || !header->is(McapOpcode::kChunk) || header->size != size - kMcapRecordHeader_bytes)
    return refuse(BagFault::kIndex, "no chunk at the position in the index");
  const auto chunk = parse_mcap<McapChunk>(std::span(bytes).subspan(kMcapRecordHeader_bytes));
  if (!chunk) return refuse(BagFault::kMalformed, "a chunk that ends within its fields");
  if (!unpack_limit_.accept(place.begin, chunk->uncompressed_size))
    return refuse(BagFault::kCompression, "a chunk of " + std::to_string(chunk->uncompressed_size) +
                                              " bytes: " + UnpackLimit::kRefusal);
  auto records = decompress(chunk->compression, chunk->records, chunk->uncompressed_size);
  if (!records.value)
    return refuse(BagFault::kCompression,
                  "a chunk (compression '" + chunk->compression + "'): " + records.refusal);
  if (chunk->uncompressed_crc != 0 && mcap_crc(*records.value) != chunk->uncompressed_crc)
    return refuse(BagFault::kChecksum, "a chunk with another checksum than it states");
  return *std::move(records.value);
}

void McapReader::add_definition(const McapRecordHeader& header, std::span<const std::uint8_t> bytes,
                                std::uint64_t place) {
  if (header.is(McapOpcode::kSchema)) {
    const auto schema = parse_mcap<McapSchema>(bytes);
    if (!schema) return report_.add(BagFault::kMalformed, place, "an invalid schema");
    schemas_.try_emplace(schema->id, schema->name);
  } else if (header.is(McapOpcode::kChannel)) {
    const auto channel = parse_mcap<McapChannel>(bytes);
    if (!channel) return report_.add(BagFault::kMalformed, place, "an invalid channel");
    add_channel(*channel, place);
  }
}

void McapReader::add_channel(const McapChannel& channel, std::uint64_t place) {
  const auto schema = schemas_.find(channel.schema_id);
  const std::string type = schema == schemas_.end() ? "" : schema->second;
  const auto [known, is_new] = channel_of_.try_emplace(channel.id, channels_.size());
  if (is_new) {
    channels_.push_back(
        {.topic = channel.topic, .type = type, .encoding = channel.message_encoding});
    return;
  }
  BagChannel& before = channels_[known->second];
  if (before.topic != channel.topic || before.encoding != channel.message_encoding)
    return report_.add(BagFault::kMalformed, place,
                       channel.topic + ": a channel that was described otherwise before");
  if (before.type.empty()) before.type = type;  // the summary lacked the schema of the channel
}

std::map<std::string, std::string> read_mcap_attachments(const std::filesystem::path& path) {
  const RandomAccessFile file(path);
  check_magic(file);
  std::map<std::string, std::string> found;
  std::uint64_t at = kMcapMagic.size();
  while (file.has(at, kMcapRecordHeader_bytes)) {
    const auto header = parse_mcap_record_header(file.read(at, kMcapRecordHeader_bytes));
    if (!header || header->is(McapOpcode::kDataEnd)) break;
    const std::uint64_t begin = at + kMcapRecordHeader_bytes;
    if (!file.has(begin, header->size)) break;
    if (header->is(McapOpcode::kAttachment)) {
      if (header->size > kMaxDecompressed_bytes)
        throw InputFileError(file.place(at) + ": an attachment of more than 512 MiB");
      const auto bytes = file.read(begin, header->size);
      const auto attachment = parse_mcap<McapAttachment>(bytes);
      if (!attachment) throw InputFileError(file.place(at) + ": an attachment that is damaged");
      found[attachment->name].assign(attachment->data.begin(), attachment->data.end());
    }
    at = begin + header->size;
  }
  return found;
}

}  // namespace km
