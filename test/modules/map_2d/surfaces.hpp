#pragma once

#include "modules/core/label_palette.hpp"
#include "modules/mesh/labelled_mesh.hpp"

namespace km::test {

inline constexpr LabelId kWallLabel = 1, kFloorLabel = 2;

inline LabelPalette two_class_palette() {
  return LabelPalette({{kWallLabel, "wall", {1, 1, 1}}, {kFloorLabel, "floor", {2, 2, 2}}});
}

/// Meshes of rectangles.
class Surfaces {
 public:
  /// Parallelogram with a corner and two edges; free space is on the side of u x v.
  Surfaces& add(const Eigen::Vector3f& corner, const Eigen::Vector3f& u, const Eigen::Vector3f& v,
                LabelId label) {
    const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
    for (const auto& vertex : {corner, Eigen::Vector3f(corner + u), Eigen::Vector3f(corner + u + v),
                               Eigen::Vector3f(corner + v)})
      mesh.vertices.push_back(vertex);
    mesh.labels.insert(mesh.labels.end(), 4, label);
    mesh.faces.push_back({first, first + 1, first + 2});
    mesh.faces.push_back({first, first + 2, first + 3});
    return *this;
  }

  /// Level rectangle seen from above, or with `from_below` from below.
  Surfaces& level(float x0, float y0, float x1, float y1, float z, LabelId label,
                  bool from_below = false) {
    const Eigen::Vector3f u(x1 - x0, 0, 0), v(0, y1 - y0, 0);
    return from_below ? add({x0, y0, z}, v, u, label) : add({x0, y0, z}, u, v, label);
  }

  /// Vertical rectangle over a segment, seen from its left side.
  Surfaces& wall(float x0, float y0, float x1, float y1, float z0, float z1) {
    return add({x0, y0, z0}, {0, 0, z1 - z0}, {x1 - x0, y1 - y0, 0}, kWallLabel);
  }

  /// Room with floor and four walls, seen from inside.
  Surfaces& room(float x0, float y0, float x1, float y1) {
    level(x0, y0, x1, y1, 0, kFloorLabel);
    constexpr float kHigh = 2.5F;
    wall(x0, y0, x1, y0, 0, kHigh).wall(x1, y0, x1, y1, 0, kHigh);
    return wall(x1, y1, x0, y1, 0, kHigh).wall(x0, y1, x0, y0, 0, kHigh);
  }

  Surfaces& without_labels() {
    mesh.labels.clear();
    return *this;
  }

  LabelledMesh mesh;
};

}  // namespace km::test
