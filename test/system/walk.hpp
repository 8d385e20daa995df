#pragma once

#include <cstdint>
#include <filesystem>
#include <numbers>

#include "modules/core/geometry/geometry.hpp"
#include "modules/recorded_graph/g2o_io.hpp"

namespace km {

inline constexpr std::uint32_t kLap = 120;  ///< Keyframes around a circle.

/// A robot that walks one lap, from keyframe 0 at place `start` of the circle.
struct Walk {
  RobotId robot = 0;
  std::uint32_t start = 0;

  [[nodiscard]] std::uint32_t place(std::uint32_t keyframe) const {
    return (start + keyframe) % kLap;
  }
  [[nodiscard]] KeyframeId keyframe_at(std::uint32_t at) const {
    return {robot, (at + kLap - start) % kLap};
  }
};

inline SE3 pose_at(std::uint32_t place) {
  constexpr double kRadius_m = 20.0;
  const double angle_rad = 2.0 * std::numbers::pi * place / kLap;
  const Eigen::AngleAxisd R(angle_rad, Eigen::Vector3d::UnitZ());
  return make_pose(R.toRotationMatrix(), R * Eigen::Vector3d(kRadius_m, 0.0, 0.0));
}

/// Writes what a walk measures: its odometry, and up to keyframe `last` closures with `other` where
/// that has been at the same place. `file`.
inline std::filesystem::path write_walk(const Walk& walk, const Walk& other, std::uint32_t last,
                                        const std::filesystem::path& file) {
  G2oGraph graph;
  const auto measure = [&](const KeyframeId& from, const KeyframeId& to, const SE3& T_from_to) {
    graph.edges.push_back({from, to, T_from_to, 1e-4 * Matrix6::Identity()});
  };
  const SE3 T_step = pose_at(0).inverse() * pose_at(1);
  for (std::uint32_t i = 0; i + 1 < kLap; ++i)
    measure({walk.robot, i}, {walk.robot, i + 1}, T_step);
  for (std::uint32_t i = 0; i < last; i += 6)
    measure({walk.robot, i}, other.keyframe_at(walk.place(i)), SE3::Identity());
  write_g2o(file, graph);
  return file;
}

}  // namespace km
