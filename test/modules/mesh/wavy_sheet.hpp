#pragma once

#include <cmath>
#include <cstdint>

#include "modules/mesh/labelled_mesh.hpp"

namespace km {

/// A hilly square of (side + 1)^2 vertices, `step_m` apart in x and y, around the origin, with
/// striped labels.
inline LabelledMesh wavy_sheet(std::uint32_t side, double step_m) {
  LabelledMesh mesh;
  const double middle_m = 0.5 * static_cast<double>(side) * step_m;
  for (std::uint32_t i = 0; i <= side; ++i)
    for (std::uint32_t j = 0; j <= side; ++j) {
      const double x = static_cast<double>(i) * step_m - middle_m;
      const double y = static_cast<double>(j) * step_m - middle_m;
      mesh.vertices.push_back(Eigen::Vector3d(x, y, std::sin(x) * std::cos(y)).cast<float>());
      mesh.labels.push_back(static_cast<LabelId>(1 + i % 5));
    }
  const std::uint32_t width = side + 1;
  for (std::uint32_t i = 0; i < side; ++i)
    for (std::uint32_t j = 0; j < side; ++j) {
      const std::uint32_t a = i * width + j;
      mesh.faces.push_back({a, a + width, a + width + 1});
      mesh.faces.push_back({a, a + width + 1, a + 1});
    }
  return mesh;
}

}  // namespace km
