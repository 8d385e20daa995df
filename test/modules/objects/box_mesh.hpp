#pragma once

#include <array>
#include <cmath>
#include <vector>

#include "test/support/grid_mesh.hpp"

namespace km {

inline constexpr LabelId kChair = 7, kTable = 8, kGround = 2;

/// A map as a mapper makes it: vertices with labels, and the keyframes that saw them.
struct TestMap {
  LabelledMesh mesh;
  std::vector<std::array<KeyframeIndex, 2>> seen_by;

  /// Adds a sheet of squares of 0.1 m from `origin` along `u` and `v` [m].
  void add_sheet(const Eigen::Vector3d& origin, const Eigen::Vector3d& u, const Eigen::Vector3d& v,
                 LabelId label, std::array<KeyframeIndex, 2> seen) {
    const double columns = std::round(u.norm() / 0.1), rows = std::round(v.norm() / 0.1);
    LabelledMesh sheet = grid_mesh(
        static_cast<std::size_t>(columns), static_cast<std::size_t>(rows),
        [&](std::size_t c, std::size_t r) -> Eigen::Vector3f {
          return (origin + u * static_cast<double>(c) / columns + v * static_cast<double>(r) / rows)
              .cast<float>();
        });
    sheet.labels.assign(sheet.vertices.size(), label);
    seen_by.insert(seen_by.end(), sheet.vertices.size(), seen);
    mesh.append(sheet);
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
