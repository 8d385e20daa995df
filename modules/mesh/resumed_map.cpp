#include "modules/mesh/resumed_map.hpp"

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

namespace km {
namespace {

// Removes the vertices that no face has.
void drop_unused(MapMesh& map) {
  std::vector<bool> used(map.mesh.vertices.size(), false);
  for (const LabelledMesh::Face& face : map.mesh.faces)
    for (const std::uint32_t vertex : face) used[vertex] = true;
  std::vector<std::uint32_t> kept;
  for (std::uint32_t vertex = 0; vertex < used.size(); ++vertex)
    if (used[vertex]) kept.push_back(vertex);
  map.mesh.keep_vertices(kept);
  keep_elements(map.seen_by, kept);
  keep_elements(map.ids, kept);
  keep_elements(map.certainty, kept);
  keep_elements(map.levels, kept);
}

}  // namespace

ResumedMap::ResumedMap(MapMesh before, KeyframeIndex keyframes) : before_(std::move(before)) {
  for (auto& views : before_.seen_by)
    for (KeyframeIndex& keyframe : views) keyframe = std::min(keyframe, keyframes - 1);
  if (!before_.ids.empty()) next_id_ = before_.ids.back() + 1;
}

MapMesh ResumedMap::with(const MapMesh& now) const {
  MapMesh both = before_;
  const std::size_t first = both.mesh.vertices.size(), added = now.mesh.vertices.size();
  both.mesh.append(now.mesh);
  append_elements(both.seen_by, first, now.seen_by, added);
  append_elements(both.certainty, first, now.certainty, added);
  append_elements(both.levels, first, now.levels, added);
  for (const std::uint64_t id : now.ids) both.ids.push_back(next_id_ + id);
  if (now.voxel_m > 0.0) both.voxel_m = now.voxel_m;
  both.views = now.views;
  return both;
}

SupersededSurface ResumedMap::drop(const SupersededSurface& superseded) {
  std::vector<bool> listed(before_.mesh.vertices.size(), false);
  SupersededSurface of_mapper;
  for (const auto& [id, replacement] : superseded.vertices) {
    if (id >= next_id_) {
      if (replacement >= next_id_)
        of_mapper.vertices.push_back({id - next_id_, replacement - next_id_});
      continue;
    }
    const auto found = std::ranges::lower_bound(before_.ids, id);
    if (found != before_.ids.end() && *found == id)
      listed[static_cast<std::size_t>(found - before_.ids.begin())] = true;
  }
  std::erase_if(before_.mesh.faces, [&](const LabelledMesh::Face& face) {
    return listed[face[0]] && listed[face[1]] && listed[face[2]];
  });
  drop_unused(before_);
  return of_mapper;
}

}  // namespace km
