#include "modules/surface_ties/chunk_visits.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numeric>
#include <utility>

namespace km {
namespace {

KeyframeIndex keyframe_of(const MeshChunk& chunk, MeshChunk::View view) {
  const std::size_t slot = view / kViewsPerKeyframe, share = view % kViewsPerKeyframe;
  const KeyframeIndex before = chunk.keyframes[slot].index;
  if (share == 0) return before;
  const std::uint64_t step = chunk.keyframes[slot + 1].index - before;
  return before + static_cast<KeyframeIndex>(share * step / kViewsPerKeyframe);
}

SeenBy seen_by(const MeshChunk& chunk, std::size_t vertex) {
  const auto [first, last] = chunk.views[vertex];
  return {keyframe_of(chunk, std::min(first, last)), keyframe_of(chunk, std::max(first, last))};
}

// The visit of each vertex, from 0 in order of time.
std::vector<std::size_t> find_visits(const MeshChunk& chunk, KeyframeIndex max_gap_keyframes) {
  std::vector<std::pair<std::uint64_t, std::size_t>> order;  // by the middle of the views
  for (std::size_t v = 0; v < chunk.views.size(); ++v) {
    const auto [first, last] = seen_by(chunk, v);
    order.emplace_back(std::uint64_t{first} + last, v);
  }
  std::ranges::sort(order);
  std::vector<SeenBy> first_of;  // views of the first vertex of each visit
  std::vector<std::size_t> visits(order.size());
  for (const auto& [middle, v] : order) {
    const SeenBy views = seen_by(chunk, v);
    const auto visit = std::ranges::find_if(first_of, [&](const SeenBy& first) {
      return keyframe_gap(first, views) <= max_gap_keyframes;
    });
    visits[v] = static_cast<std::size_t>(visit - first_of.begin());
    if (visit == first_of.end()) first_of.push_back(views);
  }
  return visits;
}

// The vertices of one visit, and the faces between them.
MeshChunk surface_of(const MeshChunk& chunk, const std::vector<std::size_t>& visits,
                     std::size_t visit) {
  constexpr std::uint16_t kNone = std::numeric_limits<std::uint16_t>::max();
  MeshChunk part = chunk;
  part.faces.clear();
  std::vector<std::uint32_t> kept;
  std::vector<std::uint16_t> index(visits.size(), kNone);
  const auto keep = [&](std::uint16_t v) {
    if (index[v] != kNone) return;
    index[v] = static_cast<std::uint16_t>(kept.size());
    kept.push_back(v);
  };
  for (const MeshChunk::Triple& face : chunk.faces) {
    if (std::ranges::any_of(face, [&](auto v) { return visits[v] != visit; })) continue;
    std::ranges::for_each(face, keep);
    part.faces.push_back({index[face[0]], index[face[1]], index[face[2]]});
  }
  const auto take = [&](auto& values) {
    const auto all = std::exchange(values, {});
    if (all.empty()) return;
    for (const std::uint32_t v : kept) values.push_back(all[v]);
  };
  take(part.offsets);
  take(part.labels);
  take(part.views);
  take(part.certainty);
  return part;
}

}  // namespace

SeenBy seen_by(const MeshChunk& chunk) {
  SeenBy all = seen_by(chunk, 0);
  for (std::size_t v = 1; v < chunk.views.size(); ++v) {
    const auto [first, last] = seen_by(chunk, v);
    all = {std::min(all[0], first), std::max(all[1], last)};
  }
  return all;
}

std::vector<MeshChunk> split_visits(const MeshChunk& chunk, KeyframeIndex max_gap_keyframes) {
  const std::vector<std::size_t> visits = find_visits(chunk, max_gap_keyframes);
  const std::size_t count = visits.empty() ? 0 : std::ranges::max(visits) + 1;
  if (count == 1) return {chunk};
  std::vector<MeshChunk> parts;
  for (std::size_t visit = 0; visit < count; ++visit) {
    MeshChunk part = surface_of(chunk, visits, visit);
    if (!part.empty()) parts.push_back(std::move(part));
  }
  return parts;
}

}  // namespace km
