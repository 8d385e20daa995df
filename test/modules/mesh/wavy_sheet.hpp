#pragma once

#include <cmath>
#include <cstdint>

#include "test/support/grid_mesh.hpp"

namespace km {

/// A hilly square of (side + 1)^2 vertices, `step_m` apart in x and y, around the origin, with
/// striped labels.
inline LabelledMesh wavy_sheet(std::uint32_t side, double step_m) {
  const double middle_m = 0.5 * static_cast<double>(side) * step_m;
  LabelledMesh mesh = grid_mesh(side, side, [&](std::size_t i, std::size_t j) -> Eigen::Vector3f {
    const double x = static_cast<double>(i) * step_m - middle_m;
    const double y = static_cast<double>(j) * step_m - middle_m;
    return Eigen::Vector3d(x, y, std::sin(x) * std::cos(y)).cast<float>();
  });
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
    mesh.labels.push_back(static_cast<LabelId>(1 + v / (side + 1) % 5));
  return mesh;
}

}  // namespace km
