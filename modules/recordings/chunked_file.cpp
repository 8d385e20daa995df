#include "modules/recordings/chunked_file.hpp"

#include <algorithm>

#include "modules/recordings/decompress.hpp"

namespace km {

std::vector<std::uint8_t> ChunkedFile::unpack(std::uint64_t begin, const std::string& compression,
                                              std::span<const std::uint8_t> bytes,
                                              std::uint64_t size) {
  const std::string chunk = "a chunk (" + std::to_string(size) + " bytes, compression '" +
                            compression + "'): ";  // decompressed
  const bool is_new = !unpacked_.contains(begin);
  if (is_new && size > left_bytes_) {
    fault(BagFault::kCompression, begin,
          chunk + "with those before it, more than 64 MiB and 250 times the file");
    return {};
  }
  if (is_new) left_bytes_ -= size;
  unpacked_.insert(begin);
  auto records = decompress(compression, bytes, size);
  if (!records.value) fault(BagFault::kCompression, begin, chunk + records.refusal);
  return std::move(records.value).value_or(std::vector<std::uint8_t>());
}

Chunk ChunkedFile::load(const ChunkRange& place) {
  is_known_ = !read_.insert(place.begin).second;
  Chunk chunk = parse_(place);
  is_known_ = false;
  return chunk;
}

void ChunkedFile::scan(std::uint64_t begin, std::uint64_t end, bool counts) {
  ChunkRange place{.begin = begin, .end = end};
  const Chunk chunk = load(place);
  if (chunk.entries.empty()) return;
  place.first = std::ranges::min(chunk.entries, {}, &Chunk::Entry::log_time).log_time;
  places.push_back(place);
  if (!counts) return;
  for (const Chunk::Entry& entry : chunk.entries) ++channels.at(entry.channel).message_count;
}

std::optional<BagMessage> ChunkedFile::next() {
  if (!merge_)
    merge_.emplace(
        std::move(places), [this](const ChunkRange& place) { return load(place); },
        [this](const ChunkRange& place, const Chunk::Entry& entry) {
          fault(BagFault::kUnordered, place.begin, channels.at(entry.channel).topic);
        });
  return merge_->next();
}

}  // namespace km
