#include "modules/mesh/mesh_origin.hpp"

#include <algorithm>
#include <cmath>

namespace km {

std::map<MeshCells::Cell, KeyframeIndex> keyframes_of_cells(
    const LabelledMesh& mesh, std::span<const std::array<KeyframeIndex, 2>> seen_by,
    double cell_m) {
  std::map<MeshCells::Cell, std::vector<KeyframeIndex>> seen;
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    const auto& [first, last] = seen_by[v];
    const Eigen::Array3d cell = (mesh.vertices[v].cast<double>().array() / cell_m).floor();
    seen[{static_cast<std::int32_t>(cell.x()), static_cast<std::int32_t>(cell.y()),
          static_cast<std::int32_t>(cell.z())}]
        .push_back(first + (last - first) / 2);
  }
  std::map<MeshCells::Cell, KeyframeIndex> medians;
  for (auto& [cell, keyframes] : seen) {
    const auto middle = keyframes.begin() + static_cast<std::ptrdiff_t>(keyframes.size() / 2);
    std::ranges::nth_element(keyframes, middle);
    medians.emplace(cell, *middle);
  }
  return medians;
}

}  // namespace km
