#pragma once

#include <random>
#include <vector>

#include "modules/core/lie.hpp"
#include "modules/objects/map_object.hpp"
#include "test/modules/constellations/scenes.hpp"

namespace km {

/// The message of a robot that drove through `scene` along x, in the direction `sign`. Keyframe k
/// is at x = sign * (3 k - 30), heading along the motion. The frame `world` of the robot has the
/// pose T_scene_world. The centres err by `sigma_m`, and the odometry is exact.
inline RobotObjects message_of(RobotId robot, const std::vector<TrueObject>& scene,
                               const SE3& T_scene_world, double sign, double sigma_m,
                               std::mt19937& rng) {
  RobotObjects message{.robot = robot, .boot = 1, .anchor = robot, .objects = {}};
  const Eigen::Matrix3d heading =
      Eigen::AngleAxisd(sign > 0.0 ? 0.0 : std::numbers::pi, Eigen::Vector3d::UnitZ())
          .toRotationMatrix();
  const auto pose_of = [&](KeyframeIndex k) {
    return SE3(T_scene_world.inverse() * make_pose(heading, {sign * (3.0 * k - 30.0), 0.0, 0.0}));
  };
  for (const TrueObject& object : scene) {
    const double way_m = sign * object.center.x() + 30.0;
    const auto k = static_cast<KeyframeIndex>(std::clamp(way_m / 3.0, 0.0, 20.0));
    Eigen::Vector3d center = object.center;
    for (double& c : center) c += sigma_m * normal(rng);
    const SE3 T_world_box =
        T_scene_world.inverse() * make_pose(Eigen::Matrix3d::Identity(), center);
    message.objects.push_back({.label = object.label,
                               .keyframe = k,
                               .T_kf_box = pose_of(k).inverse() * T_world_box,
                               .T_world_kf = pose_of(k),
                               .size_m = object.size_m,
                               .surface_m2 = 1.0,
                               .views = 5});
  }
  for (const KeyframeIndex k : {0U, 8U, 18U})
    message.keyframes.push_back(
        {{.id = {robot, k}, .T_odom_kf = pose_of(0).inverse() * pose_of(k)}, pose_of(k)});
  return message;
}

}  // namespace km
