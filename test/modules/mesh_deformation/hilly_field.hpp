#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <random>
#include <vector>

#include "modules/core/lie.hpp"
#include "modules/mesh/map_mesh.hpp"
#include "test/support/random_pose.hpp"

namespace km {

/// A hilly square of side x side vertices, 5 cm apart, mapped on a path back and forth along x in
/// lanes of equal width, with evenly spaced keyframes. A vertex is seen by the ten keyframes around
/// the nearest one in its lane.
struct HillyField {
  MapMesh map;
  std::vector<SE3> T_odom_kf;
};

inline HillyField hilly_field(std::size_t side, std::size_t keyframes, std::size_t lanes) {
  constexpr double kStep_m = 0.05;
  const double length_m = static_cast<double>(side - 1) * kStep_m;
  const std::size_t per_lane = keyframes / lanes;
  const double lane_m = length_m / static_cast<double>(lanes);
  HillyField field;
  for (std::size_t i = 0; i < keyframes; ++i) {
    const std::size_t lane = std::min(i / per_lane, lanes - 1);
    const double along =
        (static_cast<double>(i - lane * per_lane) + 0.5) / static_cast<double>(per_lane);
    const double x = length_m * (lane % 2 == 0 ? along : 1.0 - along);
    const double y = lane_m * (static_cast<double>(lane) + 0.5);
    field.T_odom_kf.push_back(make_pose(Eigen::Matrix3d::Identity(), {x, y, 1.5}));
  }
  for (std::size_t i = 0; i < side; ++i)
    for (std::size_t j = 0; j < side; ++j) {
      const double x = static_cast<double>(i) * kStep_m;
      const double y = static_cast<double>(j) * kStep_m;
      const auto lane = std::min(static_cast<std::size_t>(y / lane_m), lanes - 1);
      const double along = lane % 2 == 0 ? x / length_m : 1.0 - x / length_m;
      const auto near =
          lane * per_lane + static_cast<std::size_t>(along * static_cast<double>(per_lane - 1));
      field.map.mesh.vertices.push_back(
          Eigen::Vector3d(x, y, 0.5 * std::sin(x) * std::sin(y)).cast<float>());
      field.map.seen_by.push_back({static_cast<KeyframeIndex>(near < 5 ? 0 : near - 5),
                                   static_cast<KeyframeIndex>(std::min(near + 5, keyframes - 1))});
      field.map.ids.push_back(field.map.ids.size());
    }
  const auto width = static_cast<std::uint32_t>(side);
  for (std::uint32_t i = 0; i + 1 < width; ++i)
    for (std::uint32_t j = 0; j + 1 < width; ++j) {
      const std::uint32_t a = i * width + j;
      field.map.mesh.faces.push_back({a, a + width, a + width + 1});
      field.map.mesh.faces.push_back({a, a + width + 1, a + 1});
    }
  return field;
}

/// The path with noise on every step from keyframe to keyframe, standard deviations per axis, like
/// the drift of odometry.
inline std::vector<SE3> drifted(const std::vector<SE3>& poses, unsigned seed, double rotation_rad,
                                double translation_m) {
  std::mt19937 rng(seed);
  std::vector<SE3> result = {poses.front()};
  for (std::size_t i = 1; i < poses.size(); ++i) {
    Vector6 xi;
    xi.head<3>() = rotation_rad * random_vector<3>(rng);
    xi.tail<3>() = translation_m * random_vector<3>(rng);
    result.push_back(result.back() * poses[i - 1].inverse() * poses[i] * se3_exp(xi));
  }
  return result;
}

}  // namespace km
