#include "modules/recordings/chunk_merge.hpp"

#include <algorithm>
#include <tuple>
#include <utility>

namespace km {

ChunkMerge::ChunkMerge(std::vector<ChunkRange> places, Load load, Lost lost,
                       std::uint64_t held_bytes)
    : load_(std::move(load)), lost_(std::move(lost)), max_held_bytes_(held_bytes) {
  std::sort(places.begin(), places.end(), [](const ChunkRange& a, const ChunkRange& b) {
    return std::tie(a.first, a.begin) < std::tie(b.first, b.begin);
  });
  waiting_.assign(places.begin(), places.end());
}

std::vector<ChunkMerge::Open>::iterator ChunkMerge::earliest() {
  return std::min_element(open_.begin(), open_.end(), [](const Open& a, const Open& b) {
    return std::tie(a.chunk.entries[a.next].log_time, a.place.begin) <
           std::tie(b.chunk.entries[b.next].log_time, b.place.begin);
  });
}

void ChunkMerge::open_due() {
  while (!waiting_.empty()) {
    if (!open_.empty()) {
      const auto top = earliest();
      if (waiting_.front().first > top->chunk.entries[top->next].log_time) return;
    }
    const ChunkRange place = waiting_.front();
    waiting_.pop_front();
    open(place);
  }
}

void ChunkMerge::open(const ChunkRange& place) {
  make_room();
  Open opened{.place = place, .chunk = load_(place)};
  auto& entries = opened.chunk.entries;
  if (entries.empty()) return;
  std::stable_sort(
      entries.begin(), entries.end(),
      [](const Chunk::Entry& a, const Chunk::Entry& b) { return a.log_time < b.log_time; });
  held_bytes_ += opened.chunk.bytes.size();
  open_.push_back(std::move(opened));
}

void ChunkMerge::make_room() {
  if (held_bytes_ <= max_held_bytes_) return;
  for (Open& open : open_) open.chunk.bytes = {};
  held_bytes_ = 0;
}

std::optional<std::vector<std::uint8_t>> ChunkMerge::bytes_of(Open& open,
                                                              const Chunk::Entry& entry) {
  std::vector<std::uint8_t>& bytes = open.chunk.bytes;
  if (bytes.empty() && entry.size > 0) {
    make_room();
    bytes = load_(open.place).bytes;
    held_bytes_ += bytes.size();
  }
  if (bytes.size() < entry.begin + entry.size) return std::nullopt;
  const auto begin = bytes.begin() + static_cast<std::ptrdiff_t>(entry.begin);
  return std::vector<std::uint8_t>(begin, begin + entry.size);
}

std::optional<BagMessage> ChunkMerge::next() {
  for (open_due(); !open_.empty(); open_due()) {
    const auto open = earliest();
    const Chunk::Entry entry = open->chunk.entries[open->next++];
    std::optional<std::vector<std::uint8_t>> bytes;
    if (!last_ || entry.log_time >= *last_) bytes = bytes_of(*open, entry);
    if (!bytes) lost_(open->place, entry);
    if (open->next == open->chunk.entries.size()) {
      held_bytes_ -= open->chunk.bytes.size();
      open_.erase(open);
    }
    if (!bytes) continue;
    last_ = entry.log_time;
    return BagMessage{
        .channel = entry.channel, .log_time = entry.log_time, .bytes = std::move(*bytes)};
  }
  return std::nullopt;
}

}  // namespace km
