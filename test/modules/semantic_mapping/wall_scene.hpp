#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include "modules/semantic_mapping/semantic_mapper.hpp"
#include "test/modules/semantic_mapping/box_room.hpp"

namespace km {

/// A quarter of the benchmark's camera: 160 x 120.
inline PinholeCamera small_camera() {
  PinholeCamera camera = BoxRoom::camera();
  camera.width /= 4;
  camera.height /= 4;
  camera.fx = camera.fy = camera.fx / 4.0;
  camera.cx = 79.5;
  camera.cy = 59.5;
  return camera;
}

inline SemanticMappingConfig settings(double voxel_m = 0.1) {
  SemanticMappingConfig config;
  config.min_weight = 0.0;  // one frame is often all there is
  config.voxel_size_m = voxel_m;
  return config;
}

/// A wall at z = `wall_m`, and before it, if `ball`, a ball of radius 0.4 m at z = 1.5 m. Labels
/// 1, 2.
inline auto wall_and_ball(double wall_m, bool ball) {
  return [=](const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, LabelId& label) {
    const Eigen::Vector3d to_origin = origin - Eigen::Vector3d(0.0, 0.0, 1.5);
    const double a = direction.squaredNorm(), b = direction.dot(to_origin);
    const double root = b * b - a * (to_origin.squaredNorm() - 0.4 * 0.4);
    if (ball && root > 0.0) {
      label = 2;
      return (-b - std::sqrt(root)) / a;
    }
    label = 1;
    return direction.z() > 0.0 ? (wall_m - origin.z()) / direction.z()
                               : std::numeric_limits<double>::infinity();
  };
}

inline DepthAndLabels wall(double wall_m, bool ball = false,
                           const SE3& T_odom_cam = SE3::Identity()) {
  return render(small_camera(), T_odom_cam, wall_and_ball(wall_m, ball));
}

inline SE3 at(double x, double y = 0.0, double z = 0.0) {
  return make_pose(Eigen::Matrix3d::Identity(), {x, y, z});
}

inline bool integrate(SemanticMapper& mapper, const DepthAndLabels& images, const SE3& T_odom_cam,
                      KeyframeIndex keyframe) {
  return mapper.integrate(images.depth, &images.labels, T_odom_cam, keyframe).status ==
         IntegrationStatus::kIntegrated;
}

inline LabelPalette two_classes() {
  return LabelPalette({{1, "wall", {200, 0, 0}}, {2, "ball", {0, 200, 0}}});
}

inline std::size_t vertices_before(const MapMesh& map, double z_m) {
  return static_cast<std::size_t>(
      std::count_if(map.mesh.vertices.begin(), map.mesh.vertices.end(),
                    [&](const Eigen::Vector3f& p) { return static_cast<double>(p.z()) < z_m; }));
}

}  // namespace km
