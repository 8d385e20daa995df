#include <algorithm>
#include <map>
#include <memory>
#include <utility>

#include "modules/core/io/bytes.hpp"
#include "modules/core/io/input_file.hpp"
#include "modules/recordings/chunked_file.hpp"
#include "modules/recordings/mcap_records.hpp"
#include "modules/recordings/open_bag.hpp"

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

class McapReader final : public BagReader {
 public:
  explicit McapReader(const std::filesystem::path& path)
      : chunks_(path, [this](const ChunkRange& place) { return parse(place); }) {
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
  }

  [[nodiscard]] const std::vector<BagChannel>& channels() const override {
    return chunks_.channels.channels();
  }
  [[nodiscard]] std::optional<BagMessage> next() override { return chunks_.next(); }
  [[nodiscard]] BagReport report() const override { return chunks_.faults(); }

 private:
  struct Summary {
    std::vector<McapChunkIndex> chunks;  // chunks in the order of the file
    std::optional<McapStatistics> statistics;
  };

  // The end of the data section. Sets summary_ if it describes all channels and chunks.
  [[nodiscard]] std::uint64_t find_data_end() {
    const std::uint64_t size = file_.size();
    const std::uint64_t tail = kFooter_bytes + kMcapMagic.size();
    const std::uint64_t begin = size - std::min(size, tail);
    const Bytes bytes = file_.read(begin, size - begin);
    const auto header = parse_mcap_record_header(bytes);
    const auto footer = bytes.size() == tail
                            ? parse_mcap<McapFooter>(std::span(bytes).subspan(
                                  kMcapRecordHeader_bytes, kMcapFooterFields_bytes))
                            : std::nullopt;
    const bool ends = std::string(bytes.end() - kMcapMagic.size(), bytes.end()) == kMcapMagic;
    if (!ends || !header || !header->is(McapOpcode::kFooter) || !footer) {
      chunks_.fault(BagFault::kTruncated, size, "the file has no end");
      return size;
    }
    if (footer->summary_start == 0) return begin;
    if (footer->summary_start < kMcapMagic.size() || footer->summary_start > begin) {
      chunks_.fault(BagFault::kIndex, begin, "a summary outside of the file");
      return begin;
    }
    read_summary(footer->summary_start, begin, *footer);
    return footer->summary_start;
  }

  void read_summary(std::uint64_t begin, std::uint64_t footer, const McapFooter& fields) {
    // The checksum covers the summary and the fields of the footer before the checksum.
    const std::uint64_t end = footer + kFooter_bytes - sizeof(fields.summary_crc);
    if (end - begin > kMaxDecompressed_bytes)
      return chunks_.fault(BagFault::kIndex, begin, "a summary of more than 512 MiB");
    const Bytes bytes = file_.read(begin, end - begin);
    if (fields.summary_crc != 0 && mcap_crc(bytes) != fields.summary_crc)
      return chunks_.fault(BagFault::kIndex, begin,
                           "a summary with another checksum than it states");
    Summary summary;
    bool is_whole = true;
    is_whole &=
        for_each_record(std::span(bytes).first(footer - begin), [&](const McapRecord& read) {
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
      chunks_.channels = {};
      return chunks_.fault(BagFault::kIndex, begin, misfit);
    }
    if (describes_all(summary)) summary_ = std::move(summary);
  }

  // The reason why the summary does not fit this file, or null. Sorts the chunks of the summary by
  // position.
  [[nodiscard]] static const char* misfit_of(Summary& summary, std::uint64_t data_end) {
    std::ranges::sort(summary.chunks, {}, &McapChunkIndex::chunk_start);
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

  // True if the summary lists all channels with their schemas and all chunks, which the
  // specification does not demand.
  [[nodiscard]] bool describes_all(const Summary& summary) {
    if (summary.chunks.empty() || !summary.statistics) return false;
    const auto is_known = [&](const auto& entry) {
      const auto channel = channel_of_.find(entry.first);
      return channel != channel_of_.end() && !chunks_.channels.at(channel->second).type.empty();
    };
    for (const McapChunkIndex& chunk : summary.chunks)
      if (!std::ranges::all_of(chunk.message_index_offsets, is_known)) return false;
    const auto& counts = summary.statistics->channel_message_counts;
    return !counts.empty() && std::ranges::all_of(counts, is_known);
  }

  void use_summary() {
    for (const auto& [channel, count] : summary_->statistics->channel_message_counts)
      chunks_.channels.at(channel_of_.at(channel)).message_count += count;
    for (const McapChunkIndex& chunk : summary_->chunks)
      chunks_.places.push_back({.begin = chunk.chunk_start,
                                .end = chunk.chunk_start + chunk.chunk_length,
                                .first = chunk.message_start_time});
  }

  // Reads the records between indexed chunks, or all records.
  void walk(std::uint64_t begin, std::uint64_t end, bool has_end) {
    bool has_bare = false;
    for (std::uint64_t at = begin; at < end;) {
      const Bytes bytes = file_.read(at, std::min(end - at, kMcapRecordHeader_bytes));
      const auto header = parse_mcap_record_header(bytes);
      const std::uint64_t content = at + kMcapRecordHeader_bytes;
      if (bytes.size() == kMcapRecordHeader_bytes && !header)
        return chunks_.fault(BagFault::kMalformed, at, "an invalid record");
      if (!header || header->size > end - content)
        return chunks_.fault(has_end ? BagFault::kMalformed : BagFault::kTruncated, at,
                             "a record that reaches behind the end of the data");
      const std::uint64_t next = content + header->size;
      if (header->is(McapOpcode::kSchema) || header->is(McapOpcode::kChannel)) {
        if (header->size > kMaxDefinition_bytes)
          chunks_.fault(BagFault::kMalformed, at, "a description of more than 64 MiB");
        else
          add_definition(*header, file_.read(content, header->size), at);
      } else if (header->is(McapOpcode::kMessage)) {
        note_bare_message(at, next);
        has_bare = true;
      } else if (header->is(McapOpcode::kChunk)) {
        chunks_.scan(at, next, !summary_);
      } else if (header->is(McapOpcode::kDataEnd) || header->is(McapOpcode::kFooter)) {
        if (has_end && next != end)
          chunks_.fault(BagFault::kMalformed, at, "an invalid end of the data");
        if (has_bare && header->is(McapOpcode::kDataEnd) && header->size == 4)
          check_data_crc(at, ByteReader(file_.read(content, 4)).u32());
        if (!has_end) return;
      }
      at = next;
    }
  }

  // Adds a message outside of chunks to the former part if no chunk lies between the two.
  void note_bare_message(std::uint64_t begin, std::uint64_t end) {
    const std::uint64_t content = begin + kMcapRecordHeader_bytes;
    const std::uint64_t size = end - content;
    const auto message =
        parse_mcap<McapMessage>(file_.read(content, std::min(size, kMcapMessageFields_bytes)));
    if (!message) return chunks_.fault(BagFault::kMalformed, begin, "an invalid message");
    if (size > kMaxDecompressed_bytes)
      return chunks_.fault(BagFault::kMalformed, begin, "a message of more than 512 MiB");
    const auto channel = channel_of_.find(message->channel_id);
    if (channel != channel_of_.end() && !summary_)
      ++chunks_.channels.at(channel->second).message_count;
    auto& places = chunks_.places;
    const bool joins = !places.empty() && places.back().is_bare && places.back().end <= begin &&
                       end - places.back().begin <= kBarePart_bytes;
    if (!joins)
      places.push_back({.begin = begin, .end = begin, .first = message->log_time, .is_bare = true});
    places.back().end = end;
    places.back().first = std::min(places.back().first, message->log_time);
  }

  void check_data_crc(std::uint64_t end, std::uint32_t crc) {
    constexpr std::uint64_t kPart_bytes = std::uint64_t{1} << 20U;
    if (crc == 0) return;
    std::uint32_t actual = 0;
    for (std::uint64_t at = 0; at < end; at += kPart_bytes)
      actual = mcap_crc(file_.read(at, std::min(kPart_bytes, end - at)), actual);
    if (actual != crc)
      chunks_.fault(BagFault::kChecksum, end,
                    "the data section has another checksum than it states");
  }

  [[nodiscard]] Chunk parse(const ChunkRange& place) {
    Chunk chunk{.bytes = records_of(place), .entries = {}};
    const bool is_whole = for_each_record(chunk.bytes, [&](const McapRecord& read) {
      if (!read.header.is(McapOpcode::kMessage)) {
        // walk() has read the records between messages outside of chunks.
        if (!place.is_bare) add_definition(read.header, read.content, place.begin);
        return;
      }
      const auto message = parse_mcap<McapMessage>(read.content);
      if (!message) return chunks_.fault(BagFault::kMalformed, place.begin, "an invalid message");
      const auto channel = channel_of_.find(message->channel_id);
      if (channel == channel_of_.end())
        return chunks_.fault(BagFault::kUnknownChannel, place.begin,
                             "channel " + std::to_string(message->channel_id));
      chunk.entries.push_back(
          {.log_time = message->log_time,
           .channel = static_cast<std::uint32_t>(channel->second),
           .size = static_cast<std::uint32_t>(read.content.size() - kMcapMessageFields_bytes),
           .begin = read.begin + kMcapMessageFields_bytes});
    });
    if (!is_whole)
      chunks_.fault(BagFault::kMalformed, place.begin, "a chunk with an invalid record");
    return chunk;
  }

  // The uncompressed records of a part; empty if they cannot be read.
  [[nodiscard]] Bytes records_of(const ChunkRange& place) {
    const auto refuse = [&](BagFault fault, const std::string& why) {
      chunks_.fault(fault, place.begin, why);
      return Bytes{};
    };
    const std::uint64_t size = place.end - place.begin;
    if (size > kMaxDecompressed_bytes)
      return refuse(BagFault::kMalformed, "a chunk of more than 512 MiB");
    Bytes bytes = file_.read(place.begin, size);
    if (place.is_bare) return bytes;
    const auto header = parse_mcap_record_header(bytes);
    if (!header || !header->is(McapOpcode::kChunk) ||
        header->size != size - kMcapRecordHeader_bytes)
      return refuse(BagFault::kIndex, "no chunk at the position in the index");
    const auto chunk = parse_mcap<McapChunk>(std::span(bytes).subspan(kMcapRecordHeader_bytes));
    if (!chunk) return refuse(BagFault::kMalformed, "a chunk that ends within its fields");
    Bytes records =
        chunks_.unpack(place.begin, chunk->compression, chunk->records, chunk->uncompressed_size);
    if (!records.empty() && chunk->uncompressed_crc != 0 &&
        mcap_crc(records) != chunk->uncompressed_crc)
      return refuse(BagFault::kChecksum, "a chunk with another checksum than it states");
    return records;
  }

  void add_definition(const McapRecordHeader& header, std::span<const std::uint8_t> bytes,
                      std::uint64_t place) {
    if (header.is(McapOpcode::kSchema)) {
      const auto schema = parse_mcap<McapSchema>(bytes);
      if (!schema) return chunks_.fault(BagFault::kMalformed, place, "an invalid schema");
      schemas_.try_emplace(schema->id, schema->name);
    } else if (header.is(McapOpcode::kChannel)) {
      const auto channel = parse_mcap<McapChannel>(bytes);
      if (!channel) return chunks_.fault(BagFault::kMalformed, place, "an invalid channel");
      add_channel(*channel, place);
    }
  }

  void add_channel(const McapChannel& channel, std::uint64_t place) {
    const auto schema = schemas_.find(channel.schema_id);
    const std::string type = schema == schemas_.end() ? "" : schema->second;
    const auto known = channel_of_.find(channel.id);
    if (known == channel_of_.end()) {
      channel_of_[channel.id] = chunks_.channels.add(
          {.topic = channel.topic, .type = type, .encoding = channel.message_encoding});
      return;
    }
    BagChannel& before = chunks_.channels.at(known->second);
    if (before.topic != channel.topic || before.encoding != channel.message_encoding)
      return chunks_.fault(BagFault::kMalformed, place,
                           channel.topic + ": a channel that was described otherwise before");
    if (before.type.empty()) before.type = type;  // the summary lacked the schema of the channel
  }

  ChunkedFile chunks_;
  const RandomAccessFile& file_ = chunks_.file;
  std::map<std::uint16_t, std::string> schemas_;
  std::map<std::uint16_t, std::size_t> channel_of_;
  std::optional<Summary> summary_;
};

}  // namespace

std::unique_ptr<BagReader> open_mcap(const std::filesystem::path& path) {
  return std::make_unique<McapReader>(path);
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
