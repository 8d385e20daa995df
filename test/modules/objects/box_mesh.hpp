#pragma once

#include <array>
#include <cmath>
#include <vector>

#include "modules/mesh/labelled_mesh.hpp"

namespace km {

inline constexpr LabelId kChair = 7, kTable = 8, kGround = 2;

/// A map as a mapper makes it: vertices with labels, and the keyframes that saw them.
struct TestMap {
  LabelledMesh mesh;
  std::vector<std::array<KeyframeIndex, 2>> seen_by;

  /// Adds a sheet of squares of 0.1 m from `origin` along `u` and `v` [m].
  void add_sheet(const Eigen::Vector3d& origin, const Eigen::Vector3d& u, const Eigen::Vector3d& v,
                 LabelId label, std::array<KeyframeIndex, 2> seen) {
    const auto columns = static_cast<std::uint32_t>(std::lround(u.norm() / 0.1));
    const auto rows = static_cast<std::uint32_t>(std::lround(v.norm() / 0.1));
    const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
    for (std::uint32_t r = 0; r <= rows; ++r)
      for (std::uint32_t c = 0; c <= columns; ++c) {
        mesh.vertices.emplace_back((origin + u * c / columns + v * r / rows).cast<float>());
        mesh.labels.push_back(label);
        seen_by.push_back(seen);
      }
    for (std::uint32_t r = 0; r < rows; ++r)
      for (std::uint32_t c = 0; c < columns; ++c) {
        const std::uint32_t a = first + r * (columns + 1) + c, b = a + columns + 1;
        mesh.faces.push_back({a, a + 1, b});
        mesh.faces.push_back({a + 1, b + 1, b});
      }
  }

  /// Adds the four walls and the top of a box.
  void add_box(const ObjectBox& box, LabelId label, std::array<KeyframeIndex, 2> seen = {0, 9}) {
    const SE3 T = box.pose();
    const Eigen::Vector3d x = T.linear().col(0) * box.size_m.x(),
                          y = T.linear().col(1) * box.size_m.y(), z(0.0, 0.0, box.size_m.z());
    const Eigen::Vector3d low = box.center - 0.5 * (x + y + z);
    for (const auto& [origin, u, v] : std::vector<std::array<Eigen::Vector3d, 3>>{
             {low, x, z}, {low + x, y, z}, {low + x + y, -x, z}, {low + y, -y, z}, {low + z, x, y}})
      add_sheet(origin, u, v, label, seen);
  }
};

}  // namespace km
