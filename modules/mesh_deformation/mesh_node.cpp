#include "modules/mesh_deformation/mesh_node.hpp"

#include <utility>

namespace km {

void NodeGrid::insert(const MeshNode& node, std::uint32_t index) {
  cells_[grid_cell(node.position, radius_m_)].push_back({node.position, node.seen_by, index});
}

std::uint32_t NodeGrid::nearest(const Eigen::Vector3d& point, const SeenBy& seen_by) const {
  const auto [cx, cy, cz] = grid_cell(point, radius_m_);
  std::pair<double, std::uint32_t> best{radius_m_ * radius_m_, kNoIndex};
  for (int i = 0; i < 27; ++i) {
    const auto cell = cells_.find({cx + i % 3 - 1, cy + i / 3 % 3 - 1, cz + i / 9 - 1});
    if (cell == cells_.end()) continue;
    for (const Entry& entry : cell->second) {
      if (keyframe_gap(entry.seen_by, seen_by) > max_gap_keyframes_) continue;
      const std::pair candidate{(entry.position - point).squaredNorm(), entry.index};
      if (candidate < best) best = candidate;
    }
  }
  return best.second;
}

}  // namespace km
