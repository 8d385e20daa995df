#include "modules/evaluation/mesh/mesh_rim.hpp"

#include <algorithm>
#include <numeric>
#include <tuple>
#include <utility>

namespace km {
namespace {

// For each vertex the first one at the same place.
std::vector<std::uint32_t> first_at_place(const LabelledMesh& mesh) {
  const auto place = [&](std::uint32_t i) {
    const Eigen::Vector3f& p = mesh.vertices[i];
    return std::tuple(p.x(), p.y(), p.z(), i);
  };
  std::vector<std::uint32_t> order(mesh.vertices.size());
  std::iota(order.begin(), order.end(), 0U);
  std::sort(order.begin(), order.end(),
            [&](std::uint32_t a, std::uint32_t b) { return place(a) < place(b); });
  std::vector<std::uint32_t> first(order.size());
  for (std::size_t i = 0; i < order.size(); ++i) {
    const bool again = i > 0 && mesh.vertices[order[i]] == mesh.vertices[order[i - 1]];
    first[order[i]] = again ? first[order[i - 1]] : order[i];
  }
  return first;
}

std::uint64_t edge_key(std::uint32_t a, std::uint32_t b) {
  return std::uint64_t{std::min(a, b)} << 32 | std::max(a, b);
}

}  // namespace

MeshRim::MeshRim(const LabelledMesh& mesh) : faces_(mesh.faces.size(), 0) {
  const std::vector<std::uint32_t> vertex = first_at_place(mesh);
  const auto corner = [&](std::size_t face, int k) {
    return vertex[mesh.faces[face][static_cast<std::size_t>(k % 3)]];
  };
  std::vector<std::pair<std::uint64_t, std::size_t>> edges;  // with 3 face + k
  edges.reserve(3 * mesh.faces.size());
  for (std::size_t face = 0; face < mesh.faces.size(); ++face)
    for (int k = 0; k < 3; ++k)
      edges.emplace_back(edge_key(corner(face, k), corner(face, k + 1)),
                         3 * face + static_cast<std::size_t>(k));
  std::sort(edges.begin(), edges.end());
  std::vector<bool> on_rim(mesh.vertices.size(), false);
  for (std::size_t i = 0; i < edges.size(); ++i) {
    const auto& [key, place] = edges[i];
    if ((i > 0 && edges[i - 1].first == key) || (i + 1 < edges.size() && edges[i + 1].first == key))
      continue;
    faces_[place / 3] = static_cast<std::uint8_t>(faces_[place / 3] | 1U << place % 3);
    on_rim[key >> 32] = on_rim[key & 0xffffffffU] = true;
  }
  for (std::size_t face = 0; face < mesh.faces.size(); ++face)
    for (int k = 0; k < 3; ++k)
      if (on_rim[corner(face, k)])
        faces_[face] = static_cast<std::uint8_t>(faces_[face] | 1U << (3 + k));
}

}  // namespace km
