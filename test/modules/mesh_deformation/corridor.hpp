#pragma once

#include <algorithm>
#include <cstddef>
#include <limits>
#include <vector>

#include "modules/core/geometry/geometry.hpp"
#include "modules/mesh/map_mesh.hpp"
#include "test/support/grid_mesh.hpp"

namespace km {

/// A flat grid of (columns + 1) x (rows + 1) vertices with this step [m], in the plane of x and y
/// from the origin, two triangles per cell. Ids ascend from 0. A vertex at x is seen by the
/// keyframes within two steps of x / keyframe_step_m.
struct SheetSize {
  std::size_t columns = 40;
  std::size_t rows = 8;
  double step_m = 0.25;
  double keyframe_step_m = 0.5;
};

/// 8 m by 2 m.
inline constexpr SheetSize kSheet{.columns = 32, .rows = 8, .step_m = 0.25, .keyframe_step_m = 0.5};

inline std::size_t keyframe_count(const SheetSize& size) {
  const double length_m = static_cast<double>(size.columns) * size.step_m;
  return static_cast<std::size_t>(length_m / size.keyframe_step_m) + 1;
}

inline MapMesh sheet(const SheetSize& size) {
  MapMesh map;
  map.mesh = grid_mesh(size.columns, size.rows, [&](std::size_t i, std::size_t j) {
    const double x = static_cast<double>(i) * size.step_m;
    const double y = static_cast<double>(j) * size.step_m;
    return Eigen::Vector3f(Eigen::Vector3d(x, y, 0.0).cast<float>());
  });
  const auto last = static_cast<KeyframeIndex>(keyframe_count(size) - 1);
  for (std::size_t v = 0; v < map.mesh.vertices.size(); ++v) {
    const std::size_t i = v / (size.rows + 1);
    const double x = static_cast<double>(i) * size.step_m;
    const auto near = static_cast<KeyframeIndex>(x / size.keyframe_step_m);
    map.mesh.labels.push_back(static_cast<LabelId>(i % 7));
    map.seen_by.push_back({near < 2 ? 0 : near - 2, std::min(near + 2, last)});
    map.ids.push_back(v);
  }
  return map;
}

/// Keyframes in a straight line above the middle of the sheet.
inline std::vector<SE3> keyframes_above(const SheetSize& size) {
  std::vector<SE3> keyframes;
  const double middle_m = 0.5 * static_cast<double>(size.rows) * size.step_m;
  for (std::size_t i = 0; i < keyframe_count(size); ++i)
    keyframes.push_back(make_pose(Eigen::Matrix3d::Identity(),
                                  {static_cast<double>(i) * size.keyframe_step_m, middle_m, 1.5}));
  return keyframes;
}

/// Bends the line x to a circle of this radius in the plane of x and z (up). A point (x, y, z)
/// moves to angle x / radius, z above the circle.
inline SE3 bend(const SE3& T, double radius_m) {
  const double angle = T.translation().x() / radius_m;
  const Eigen::Matrix3d R = Eigen::AngleAxisd(-angle, Eigen::Vector3d::UnitY()).toRotationMatrix();
  const Eigen::Vector3d center(0.0, T.translation().y(), radius_m);
  const Eigen::Vector3d spoke(0.0, 0.0, T.translation().z() - radius_m);
  return make_pose(R * T.linear(), center + R * spoke);
}

inline std::vector<SE3> bent(const std::vector<SE3>& poses, double radius_m) {
  std::vector<SE3> result;
  result.reserve(poses.size());
  for (const SE3& pose : poses) result.push_back(bend(pose, radius_m));
  return result;
}

inline std::vector<SE3> moved(const SE3& T, const std::vector<SE3>& poses) {
  std::vector<SE3> result;
  result.reserve(poses.size());
  for (const SE3& pose : poses) result.push_back(T * pose);
  return result;
}

/// Largest distance between the vertices of two meshes of equal size [m].
inline double largest_distance_m(const LabelledMesh& a, const LabelledMesh& b) {
  if (a.vertices.size() != b.vertices.size()) return std::numeric_limits<double>::infinity();
  double largest = 0.0;
  for (std::size_t v = 0; v < a.vertices.size(); ++v)
    largest = std::max(largest, static_cast<double>((a.vertices[v] - b.vertices[v]).norm()));
  return largest;
}

}  // namespace km
