#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "modules/mesh/labelled_mesh.hpp"
#include "modules/mesh/team_mesh.hpp"

namespace km {

/// One mesh of the chunks as they were sent, which must have one step_m. Vertices with the same
/// position and label are merged, and faces that rounding has left without area are removed.
inline LabelledMesh assembled(const std::vector<MeshChunk>& chunks) {
  LabelledMesh mesh;
  std::map<std::pair<std::array<std::int64_t, 3>, LabelId>, std::uint32_t> known;
  for (const MeshChunk& chunk : chunks) {
    std::vector<std::uint32_t> index;
    for (std::size_t v = 0; v < chunk.offsets.size(); ++v) {
      std::array<std::int64_t, 3> point{};
      for (std::size_t axis = 0; axis < 3; ++axis)
        point[axis] = std::int64_t{chunk.origin[axis]} + chunk.offsets[v][axis];
      const LabelId label = chunk.labels.empty() ? LabelId{0} : chunk.labels[v];
      const auto next = static_cast<std::uint32_t>(mesh.vertices.size());
      const auto [entry, is_new] = known.try_emplace({point, label}, next);
      index.push_back(entry->second);
      if (!is_new) continue;
      const Eigen::Vector3d steps(static_cast<double>(point[0]), static_cast<double>(point[1]),
                                  static_cast<double>(point[2]));
      mesh.vertices.push_back((static_cast<double>(chunk.step_m) * steps).cast<float>());
      if (!chunk.labels.empty()) mesh.labels.push_back(label);
    }
    for (const auto& [a, b, c] : chunk.faces)
      if (index[a] != index[b] && index[b] != index[c] && index[c] != index[a])
        mesh.faces.push_back({index[a], index[b], index[c]});
  }
  return mesh;
}

/// The mesh of one robot as it was sent.
inline LabelledMesh assembled(const TeamMesh& team, RobotId robot) {
  std::vector<MeshChunk> chunks;
  for (const PlacedChunk& placed : team.placed())
    if (placed.chunk->key.robot == robot) chunks.push_back(*placed.chunk);
  return assembled(chunks);
}

}  // namespace km
