#pragma once

#include <algorithm>

#include "modules/core/ids.hpp"
#include "modules/mesh/labelled_mesh.hpp"
#include "test/modules/evaluation/mesh/shapes.hpp"

namespace km {

/// Largest keyframe_gap() within one visit.
inline constexpr KeyframeIndex kMaxGap = 15;

/// A rectangle of faces that are smaller than the cells of samples.
inline LabelledMesh wall(const Eigen::Vector3f& corner, const Eigen::Vector3f& u,
                         const Eigen::Vector3f& v, LabelId label) {
  constexpr float kFace_m = 0.06F;
  return rectangle(corner, u, v, static_cast<int>(std::max(u.norm(), v.norm()) / kFace_m), label);
}

/// Floor and four walls of a room, seen from inside; `x_m` is its length.
inline LabelledMesh inside_of_room(float x_m = 4.0F) {
  LabelledMesh mesh = wall({0, 0, 0}, {x_m, 0, 0}, {0, 3, 0}, 1);
  mesh.append(wall({0, 0, 0}, {0, 3, 0}, {0, 0, 2}, 2));
  mesh.append(wall({x_m, 0, 0}, {0, 0, 2}, {0, 3, 0}, 3));
  mesh.append(wall({0, 0, 0}, {0, 0, 2}, {x_m, 0, 0}, 4));
  mesh.append(wall({0, 3, 0}, {x_m, 0, 0}, {0, 0, 2}, 5));
  return mesh;
}

/// Floor and two walls along x.
inline LabelledMesh corridor() {
  LabelledMesh mesh = wall({0, 0, 0}, {8, 0, 0}, {0, 2, 0}, 1);
  mesh.append(wall({0, 0, 0}, {0, 0, 2}, {8, 0, 0}, 2));
  mesh.append(wall({0, 2, 0}, {8, 0, 0}, {0, 0, 2}, 3));
  return mesh;
}

}  // namespace km
