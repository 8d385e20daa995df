#include "modules/mesh/vertex_clustering.hpp"

#include <algorithm>

namespace km {

std::uint32_t VertexClustering::cluster_of(const Eigen::Vector3d& point, const SeenBy& seen_by) {
  const auto next = static_cast<std::uint32_t>(seeds_.size());
  const GridCell cell = grid_cell(point, width_m_);
  const auto [first, is_new] = first_in_cell_.try_emplace(cell, next);
  if (!is_new) {
    std::uint32_t cluster = first->second;
    while (keyframe_gap(seeds_[cluster].seen_by, seen_by) > max_gap_keyframes_) {
      if (seeds_[cluster].next_in_cell == kNoIndex) {
        seeds_[cluster].next_in_cell = next;
        cluster = next;
        break;
      }
      cluster = seeds_[cluster].next_in_cell;
    }
    if (cluster != next) return cluster;
  }
  seeds_.push_back({seen_by, cell, kNoIndex});
  return next;
}

std::vector<LabelledMesh::Face> cluster_faces(std::span<const LabelledMesh::Face> faces,
                                              std::span<const std::uint32_t> cluster_of_vertex) {
  std::vector<LabelledMesh::Face> result;
  for (const auto& corners : faces) {
    LabelledMesh::Face face = {};
    for (std::size_t i = 0; i < 3; ++i) face[i] = cluster_of_vertex[corners[i]];
    if (face[0] == face[1] || face[1] == face[2] || face[2] == face[0]) continue;
    if (std::ranges::find(face, kNoIndex) != face.end()) continue;
    std::ranges::rotate(face, std::ranges::min_element(face));  // same orientation
    result.push_back(face);
  }
  std::ranges::sort(result);
  result.erase(std::unique(result.begin(), result.end()), result.end());
  return result;
}

}  // namespace km
