#include "modules/simulation/world/surface_mesh.hpp"

#include <limits>
#include <stdexcept>
#include <string>

namespace km {
namespace {

template <typename T>
void append_to(std::vector<T>& all, const std::vector<T>& more) {
  all.insert(all.end(), more.begin(), more.end());
}

}  // namespace

void SurfaceMesh::append(const SurfaceMesh& other) {
  const std::size_t total = vertices.size() + other.vertices.size();
  if (total > std::numeric_limits<std::uint32_t>::max()) {
    throw std::length_error("SurfaceMesh: " + std::to_string(total) +
                            " vertices are more than 32-bit indices reach");
  }
  const auto first = static_cast<std::uint32_t>(vertices.size());
  append_to(vertices, other.vertices);
  append_to(normals, other.normals);
  append_to(uv, other.uv);
  append_to(materials, other.materials);
  triangles.reserve(triangles.size() + other.triangles.size());
  for (const auto& [a, b, c] : other.triangles) {
    triangles.push_back({a + first, b + first, c + first});
  }
}

}  // namespace km
