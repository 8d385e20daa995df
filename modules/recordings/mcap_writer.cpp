#include "modules/recordings/mcap_writer.hpp"

#include <zstd.h>

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <utility>

namespace km {
namespace {

std::span<const std::uint8_t> magic() {
  return {reinterpret_cast<const std::uint8_t*>(kMcapMagic.data()), kMcapMagic.size()};
}

std::vector<std::uint8_t> compressed(std::span<const std::uint8_t> bytes) {
  constexpr int kFast = 1;
  std::vector<std::uint8_t> packed(ZSTD_compressBound(bytes.size()));  // with this size it succeeds
  packed.resize(ZSTD_compress(packed.data(), packed.size(), bytes.data(), bytes.size(), kFast));
  return packed;
}

void check_room(std::size_t count) {
  if (count >= std::numeric_limits<std::uint16_t>::max())
    throw std::length_error("more than 65535 channels or types in one MCAP file");
}

}  // namespace

McapWriter::McapWriter(Options options) : options_(std::move(options)) {
  append(magic());
  put(McapHeader{options_.profile, options_.library});
}

std::uint16_t McapWriter::add_channel(McapChannel channel, const McapSchema& schema) {
  const auto is_same = [&schema](const McapSchema& known) {
    return known.name == schema.name && known.encoding == schema.encoding &&
           known.data == schema.data;
  };
  const auto known = std::ranges::find_if(schemas_, is_same);
  channel.schema_id = static_cast<std::uint16_t>(known - schemas_.begin() + 1);
  if (known == schemas_.end()) {
    check_room(schemas_.size());
    schemas_.push_back(schema);
    schemas_.back().id = channel.schema_id;
  }
  check_room(channels_.size());
  channel.id = static_cast<std::uint16_t>(channels_.size() + 1);
  channels_.push_back(std::move(channel));
  return channels_.back().id;
}

void McapWriter::add(const McapMessage& message, std::span<const std::uint8_t> data) {
  define(channels_.at(message.channel_id - 1U));
  auto& index = chunk_.indexes[message.channel_id];
  index.channel_id = message.channel_id;
  index.messages.emplace_back(message.log_time, chunk_.records.size());
  put_mcap(chunk_.records, message, data);
  count(message);
  if (chunk_.records.size() >= options_.chunk_bytes) end_chunk();
}

// Writes the channel and its schema to the chunk before the first message of the channel.
void McapWriter::define(const McapChannel& channel) {
  if (!written_channels_.insert(channel.id).second) return;
  if (written_schemas_.insert(channel.schema_id).second)
    put_mcap(chunk_.records, schemas_[channel.schema_id - 1U]);
  put_mcap(chunk_.records, channel);
}

void McapWriter::count(const McapMessage& message) {
  const auto widen = [&message](bool is_first, Stamp& start, Stamp& end) {
    start = is_first ? message.log_time : std::min(start, message.log_time);
    end = is_first ? message.log_time : std::max(end, message.log_time);
  };
  widen(chunk_.messages++ == 0, chunk_.start, chunk_.end);
  widen(statistics_.message_count++ == 0, statistics_.message_start_time,
        statistics_.message_end_time);
  ++counts_[message.channel_id];
}

void McapWriter::end_chunk() {
  if (chunk_.messages > 0) put_chunk();
}

void McapWriter::put_chunk() {
  const auto records = chunk_.records.release();
  const auto packed = options_.compression.empty() ? records : compressed(records);
  McapChunkIndex index{.message_start_time = chunk_.start,
                       .message_end_time = chunk_.end,
                       .chunk_start = size_,
                       .compression = options_.compression,
                       .compressed_size = packed.size(),
                       .uncompressed_size = records.size()};
  put(McapChunk{.message_start_time = chunk_.start,
                .message_end_time = chunk_.end,
                .uncompressed_size = records.size(),
                .uncompressed_crc = mcap_crc(records),
                .compression = options_.compression,
                .records = packed});
  index.chunk_length = size_ - index.chunk_start;
  put_message_indexes(index);
  chunks_.push_back(std::move(index));
  chunk_ = {};
}

void McapWriter::put_message_indexes(McapChunkIndex& chunk) {
  const std::uint64_t start = size_;
  for (const auto& [channel, index] : chunk_.indexes) {
    chunk.message_index_offsets.emplace_back(channel, size_);
    put(index);
  }
  chunk.message_index_length = size_ - start;
}

void McapWriter::attach(const McapAttachment& attachment) {
  end_chunk();
  McapAttachmentIndex index{.start = size_,
                            .log_time = attachment.log_time,
                            .create_time = attachment.create_time,
                            .data_size = attachment.data.size(),
                            .name = attachment.name,
                            .media_type = attachment.media_type};
  put(attachment);
  index.length = size_ - index.start;
  attachments_.push_back(std::move(index));
}

void McapWriter::finish() {
  end_chunk();
  put(McapDataEnd{crc_});
  put_summary();
}

void McapWriter::put_summary() {
  std::vector<McapSummaryOffset> groups;
  McapFooter footer{.summary_start = size_};
  crc_ = 0;  // checksum of the summary from here on
  const auto put_group = [&]<typename Record>(const std::vector<Record>& records) {
    const std::uint64_t start = size_;
    for (const Record& record : records) put(record);
    if (size_ > start)
      groups.push_back({static_cast<std::uint8_t>(Record::kOpcode), start, size_ - start});
  };
  std::vector<McapSchema> schemas;
  std::ranges::copy_if(schemas_, std::back_inserter(schemas),
                       [this](const auto& schema) { return written_schemas_.contains(schema.id); });
  put_group(schemas);
  std::vector<McapChannel> channels;
  std::ranges::copy_if(channels_, std::back_inserter(channels), [this](const auto& channel) {
    return written_channels_.contains(channel.id);
  });
  put_group(channels);
  statistics_.schema_count = static_cast<std::uint16_t>(schemas.size());
  statistics_.channel_count = static_cast<std::uint32_t>(channels.size());
  statistics_.attachment_count = static_cast<std::uint32_t>(attachments_.size());
  statistics_.chunk_count = static_cast<std::uint32_t>(chunks_.size());
  statistics_.channel_message_counts.assign(counts_.begin(), counts_.end());
  put_group(std::vector{statistics_});
  put_group(attachments_);
  put_group(chunks_);
  footer.summary_offset_start = size_;
  for (const McapSummaryOffset& group : groups) put(group);

  ByteWriter last;
  put_mcap(last, footer);
  auto bytes = last.release();
  bytes.resize(bytes.size() - sizeof(footer.summary_crc));  // the checksum covers these bytes
  append(bytes);
  last.u32(crc_);
  last.bytes(magic());
  append(last.release());
}

std::vector<std::uint8_t> McapWriter::take() {
  return std::exchange(bytes_, {});
}

template <typename Record>
void McapWriter::put(const Record& record) {
  ByteWriter out;
  put_mcap(out, record);
  append(out.release());
}

void McapWriter::append(std::span<const std::uint8_t> bytes) {
  bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
  size_ += bytes.size();
  crc_ = mcap_crc(bytes, crc_);
}

}  // namespace km
