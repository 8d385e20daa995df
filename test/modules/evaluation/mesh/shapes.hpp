#pragma once

#include <Eigen/Geometry>
#include <cstddef>

#include "test/support/grid_mesh.hpp"

namespace km {

/// A rectangle with a corner at `corner` and the given sides, as cells x cells squares of two
/// triangles; all vertices have `label`.
inline LabelledMesh rectangle(const Eigen::Vector3f& corner, const Eigen::Vector3f& side_u,
                              const Eigen::Vector3f& side_v, std::size_t cells = 8,
                              LabelId label = 1) {
  const auto n = static_cast<float>(cells);
  LabelledMesh mesh = grid_mesh(cells, cells, [&](std::size_t i, std::size_t j) -> Eigen::Vector3f {
    return corner + side_u * static_cast<float>(i) / n + side_v * static_cast<float>(j) / n;
  });
  mesh.labels.assign(mesh.vertices.size(), label);
  return mesh;
}

/// The square [0, side]^2 at height z.
inline LabelledMesh square(float side, float z, std::size_t cells = 8, LabelId label = 1) {
  return rectangle({0, 0, z}, {side, 0, 0}, {0, side, 0}, cells, label);
}

/// Floor (label 1) and four walls (2, 3, 4, 5) of a room that is 4 x 3 x 2 m, a corner at zero.
inline LabelledMesh room() {
  LabelledMesh mesh = rectangle({0, 0, 0}, {4, 0, 0}, {0, 3, 0}, 8, 1);
  mesh.append(rectangle({0, 0, 0}, {0, 3, 0}, {0, 0, 2}, 8, 2));
  mesh.append(rectangle({4, 0, 0}, {0, 3, 0}, {0, 0, 2}, 8, 3));
  mesh.append(rectangle({0, 0, 0}, {4, 0, 0}, {0, 0, 2}, 8, 4));
  mesh.append(rectangle({0, 3, 0}, {4, 0, 0}, {0, 0, 2}, 8, 5));
  return mesh;
}

}  // namespace km
