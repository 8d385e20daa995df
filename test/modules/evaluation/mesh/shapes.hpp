#pragma once

#include <Eigen/Geometry>
#include <cstdint>

#include "modules/mesh/labelled_mesh.hpp"

namespace km {

/// A rectangle with a corner at `corner` and the given sides, as cells x cells squares of two
/// triangles; all vertices have `label`.
inline LabelledMesh rectangle(const Eigen::Vector3f& corner, const Eigen::Vector3f& side_u,
                              const Eigen::Vector3f& side_v, int cells = 8, LabelId label = 1) {
  LabelledMesh mesh;
  for (int i = 0; i <= cells; ++i)
    for (int j = 0; j <= cells; ++j)
      mesh.vertices.push_back(corner + side_u * static_cast<float>(i) / static_cast<float>(cells) +
                              side_v * static_cast<float>(j) / static_cast<float>(cells));
  const auto at = [&](int i, int j) { return static_cast<std::uint32_t>(i * (cells + 1) + j); };
  for (int i = 0; i < cells; ++i)
    for (int j = 0; j < cells; ++j) {
      mesh.faces.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      mesh.faces.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  mesh.labels.assign(mesh.vertices.size(), label);
  return mesh;
}

/// The square [0, side]^2 at height z.
inline LabelledMesh square(float side, float z, int cells = 8, LabelId label = 1) {
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
