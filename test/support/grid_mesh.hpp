#pragma once

#include <cstddef>
#include <cstdint>

#include "modules/mesh/labelled_mesh.hpp"

namespace km {

/// A grid of (columns + 1) x (rows + 1) vertices without labels. `place(i, j)` is the position of
/// row j of column i, whose vertices follow each other. Each cell is two triangles, seen from the
/// side of i x j.
template <typename Place>
[[nodiscard]] LabelledMesh grid_mesh(std::size_t columns, std::size_t rows, const Place& place) {
  LabelledMesh mesh;
  for (std::size_t i = 0; i <= columns; ++i)
    for (std::size_t j = 0; j <= rows; ++j) mesh.vertices.push_back(place(i, j));
  for (std::size_t i = 0; i < columns; ++i)
    for (std::size_t j = 0; j < rows; ++j) {
      const auto a = static_cast<std::uint32_t>(i * (rows + 1) + j);
      const auto b = static_cast<std::uint32_t>(a + rows + 1);
      mesh.faces.push_back({a, b, b + 1});
      mesh.faces.push_back({a, b + 1, a + 1});
    }
  return mesh;
}

}  // namespace km
