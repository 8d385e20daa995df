#pragma once

#include "apps/lab/simulation/world/world.hpp"
#include "test/support/test.hpp"

namespace km {

/// Checks with Catch2 that arrays go together, values are finite, normals of unit length, indices
/// exist, and that no triangle lacks an area or turns away from its normals' mean.
inline void check_sound(const SurfaceMesh& mesh, std::size_t material_count) {
  const std::size_t n = mesh.vertices.size();
  REQUIRE(mesh.normals.size() == n);
  REQUIRE(mesh.uv.size() == n);
  REQUIRE(mesh.materials.size() == mesh.triangles.size());
  int not_finite = 0, normal_length = 0, index_range = 0, no_area = 0, winding = 0;
  for (std::size_t i = 0; i < n; ++i) {
    not_finite += !mesh.vertices[i].allFinite() || !mesh.uv[i].allFinite();
    normal_length += !(std::abs(mesh.normals[i].norm() - 1.0F) <= 1e-4F);
  }
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const auto& [a, b, c] = mesh.triangles[i];
    if (std::max({a, b, c}) >= n || mesh.materials[i] >= material_count) {
      ++index_range;
      continue;
    }
    const Eigen::Vector3f cross =
        (mesh.vertices[b] - mesh.vertices[a]).cross(mesh.vertices[c] - mesh.vertices[a]);
    no_area += !(cross.norm() > 1e-8F);
    winding += cross.dot(mesh.normals[a] + mesh.normals[b] + mesh.normals[c]) < 0.0F;
  }
  CHECK(not_finite == 0);
  CHECK(normal_length == 0);
  CHECK(index_range == 0);
  CHECK(no_area == 0);
  CHECK(winding == 0);
}

}  // namespace km
