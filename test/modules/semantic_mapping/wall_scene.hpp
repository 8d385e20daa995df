#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>

#include "modules/core/camera/camera.hpp"
#include "modules/core/camera/frame.hpp"
#include "modules/core/geometry/geometry.hpp"
#include "modules/core/map/label_palette.hpp"
#include "modules/semantic_mapping/semantic_mapper.hpp"

namespace km {

/// A room of 10 x 8 x 3 m, seen from inside by an ideal depth camera that moves in a circle.
struct BoxRoom {
  static inline const Eigen::Vector3d kLow{-5.0, -4.0, 0.0};
  static inline const Eigen::Vector3d kHigh{5.0, 4.0, 3.0};

  /// Labels 1 to 6: walls at low and high x, low and high y, floor, ceiling.
  static LabelPalette palette() {
    return LabelPalette({{1, "west", {255, 0, 0}},
                         {2, "east", {0, 255, 0}},
                         {3, "south", {0, 0, 255}},
                         {4, "north", {255, 255, 0}},
                         {5, "floor", {120, 120, 120}},
                         {6, "ceiling", {200, 200, 200}}});
  }

  static Camera camera() {
    Camera camera{.width = 640, .height = 480, .fx = 525.0, .fy = 525.0, .cx = 319.5, .cy = 239.5};
    return camera;
  }

  /// On a circle of radius 2 m at height 1.5 m, 100 poses per revolution. The optical axis is the
  /// outward normal rotated left by 45 degrees.
  static SE3 T_room_cam(int frame) {
    const double angle = 2.0 * std::numbers::pi * frame / 100.0;
    const double heading = angle + std::numbers::pi / 4.0;
    Eigen::Matrix3d R;
    R.col(2) << std::cos(heading), std::sin(heading), 0.0;
    R.col(1) << 0.0, 0.0, -1.0;
    R.col(0) = R.col(1).cross(R.col(2));
    return make_pose(R, {2.0 * std::cos(angle), 2.0 * std::sin(angle), 1.5});
  }

  /// Distance of a point from the nearest of the six planes [m].
  static double distance(const Eigen::Vector3d& p) {
    return std::min((p - kLow).cwiseAbs().minCoeff(), (kHigh - p).cwiseAbs().minCoeff());
  }

  /// Label of the nearest plane.
  static LabelId label_at(const Eigen::Vector3d& p) {
    LabelId best = 0;
    double least = std::numeric_limits<double>::max();
    for (int axis = 0; axis < 3; ++axis)
      for (int side = 0; side < 2; ++side) {
        const double d = std::abs(p[axis] - (side == 0 ? kLow : kHigh)[axis]);
        if (d >= least) continue;
        least = d;
        best = static_cast<LabelId>(2 * axis + side + 1);
      }
    return best;
  }
};

/// A camera's view of a scene.
struct DepthAndLabels {
  DepthImage depth;
  LabelImage labels;
};

/// Images of `camera` (distortion included), where `cast(origin, direction, label)` gives the
/// length along `direction` to the first surface, or infinity, and sets its label. Directions have
/// length 1 along the optical axis, so that lengths are depths.
template <typename Cast>
DepthAndLabels render(const Camera& camera, const SE3& T_world_cam, const Cast& cast) {
  DepthAndLabels images;
  images.depth = {camera.width, camera.height, {}};
  images.labels = {camera.width, camera.height, {}};
  for (int v = 0; v < camera.height; ++v)
    for (int u = 0; u < camera.width; ++u) {
      const auto bearing = camera.unproject(Eigen::Vector2d(u, v));
      LabelId label = 0;
      const double depth =
          bearing ? cast(T_world_cam.translation(),
                         Eigen::Vector3d(T_world_cam.linear() * bearing->homogeneous()), label)
                  : std::numeric_limits<double>::infinity();
      const bool seen = depth < 65.0;
      images.depth.millimetres.push_back(
          seen ? static_cast<std::uint16_t>(std::lround(1000.0 * depth)) : std::uint16_t{0});
      images.labels.ids.push_back(seen ? label : LabelId{0});
    }
  return images;
}

/// The walls of the room from inside, for render().
inline double cast_room(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                        LabelId& label) {
  double nearest = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < 3; ++axis) {
    if (direction[axis] == 0.0) continue;
    const bool high = direction[axis] > 0.0;
    const double wall = (high ? BoxRoom::kHigh : BoxRoom::kLow)[axis];
    const double length = (wall - origin[axis]) / direction[axis];
    if (length >= nearest) continue;
    nearest = length;
    label = static_cast<LabelId>(2 * axis + (high ? 1 : 0) + 1);
  }
  return nearest;
}

/// A quarter of the benchmark's camera: 160 x 120.
inline Camera small_camera() {
  Camera camera = BoxRoom::camera();
  camera.width /= 4;
  camera.height /= 4;
  camera.fx = camera.fy = camera.fx / 4.0;
  camera.cx = 79.5;
  camera.cy = 59.5;
  return camera;
}

inline SemanticMappingConfig settings(double voxel_m = 0.1) {
  SemanticMappingConfig config;
  config.min_views = 1;  // often there is only one frame
  config.depth_sigma_per_m = 0.0;
  config.voxel_size_m = voxel_m;
  return config;
}

/// A wall at z = `wall_m`, and, if `ball`, a ball of radius 0.4 m at z = 1.5 m before it. Labels 1,
/// 2.
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
