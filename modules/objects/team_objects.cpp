#include "modules/objects/team_objects.hpp"

#include <algorithm>
#include <optional>
#include <utility>

#include "modules/objects/object_merging.hpp"

namespace km {
namespace {

bool differ(const AnchoredObject& a, const AnchoredObject& b, double min_change_m) {
  const SE3 T_world_a = a.T_world_kf * a.T_kf_box, T_world_b = b.T_world_kf * b.T_kf_box;
  const double reach = a.size_m.norm();
  const double moved = (T_world_a.translation() - T_world_b.translation()).norm();
  const double turned = reach * (T_world_a.linear() - T_world_b.linear()).norm();
  return a.layer != b.layer || a.label != b.label || moved > min_change_m ||
         turned > min_change_m || (a.size_m - b.size_m).cwiseAbs().maxCoeff() > min_change_m;
}

}  // namespace

RobotObjects anchored(std::span<const MapObject> objects, const Trajectory& trajectory) {
  std::vector<MapObject> chosen(objects.begin(), objects.end());
  if (chosen.size() > kMaxObjects) {
    std::ranges::stable_sort(chosen, std::greater(), &MapObject::surface_m2);
    chosen.resize(kMaxObjects);
  }
  RobotObjects message{.robot = trajectory.robot, .anchor = trajectory.anchor, .objects = {}};
  for (const MapObject& object : chosen) {
    const std::size_t last = trajectory.T_world_kf.size() - 1;
    const std::size_t k = std::min<std::size_t>(object.keyframe.index, last);
    const SE3& T_world_kf = trajectory.T_world_kf[k];
    message.objects.push_back({.layer = object.layer,
                               .label = object.label,
                               .keyframe = static_cast<KeyframeIndex>(k),
                               .T_kf_box = T_world_kf.inverse() * object.box.pose(),
                               .T_world_kf = T_world_kf,
                               .size_m = object.box.size_m,
                               .surface_m2 = object.surface_m2,
                               .views = object.views});
  }
  return message;
}

std::vector<SurfaceKeyframe> keyframes_of(const RobotObjects& objects,
                                          const std::map<KeyframeIndex, OdometryPose>& odometry) {
  constexpr KeyframeIndex kLength = 10;
  std::map<KeyframeIndex, SurfaceKeyframe> chosen;  // by keyframe / kLength
  for (const AnchoredObject& object : objects.objects) {
    const auto known = odometry.find(object.keyframe);
    if (known == odometry.end()) continue;
    SurfaceKeyframe& first =
        chosen.try_emplace(object.keyframe / kLength, known->second, object.T_world_kf)
            .first->second;
    if (object.keyframe < first.odometry.id.index) first = {known->second, object.T_world_kf};
  }
  while (chosen.size() > kMaxObjectKeyframes) chosen.erase(chosen.begin());
  std::vector<SurfaceKeyframe> keyframes;
  for (const auto& [number, keyframe] : chosen) keyframes.push_back(keyframe);
  return keyframes;
}

bool differ(const RobotObjects& a, const RobotObjects& b, double min_change_m) {
  return a.anchor != b.anchor ||
         !std::ranges::equal(a.objects, b.objects,
                             [&](const AnchoredObject& one, const AnchoredObject& other) {
                               return !differ(one, other, min_change_m);
                             });
}

bool TeamObjects::add(RobotObjects objects) {
  Robot& robot = robots_[objects.robot];
  if (robot.earlier_boots.contains(objects.boot)) return false;
  if (robot.newest.boot != objects.boot) robot.earlier_boots.insert(robot.newest.boot);
  robot.newest = std::move(objects);
  return true;
}

ObjectList TeamObjects::joint(const Trajectory& trajectory) const {
  ObjectList list{.anchor = trajectory.anchor, .objects = {}};
  const auto pose_of = [&](RobotId robot, const RobotObjects& sent,
                           const AnchoredObject& object) -> std::optional<SE3> {
    if (robot == own_)
      return object.keyframe < trajectory.T_world_kf.size()
                 ? std::optional(trajectory.T_world_kf[object.keyframe])
                 : std::nullopt;
    const auto known = trajectory.public_poses.find({robot, object.keyframe});
    if (known != trajectory.public_poses.end()) return known->second;
    return sent.anchor == trajectory.anchor ? std::optional(object.T_world_kf) : std::nullopt;
  };
  for (const auto& [id, robot] : robots_)
    for (const AnchoredObject& object : robot.newest.objects)
      if (const auto T_world_kf = pose_of(id, robot.newest, object))
        list.objects.push_back({.layer = object.layer,
                                .label = object.label,
                                .box = upright_box(*T_world_kf * object.T_kf_box, object.size_m),
                                .surface_m2 = object.surface_m2,
                                .views = object.views,
                                .keyframe = {id, object.keyframe},
                                .robots = {id}});
  list.objects = merge_objects(std::move(list.objects), config_);
  return list;
}

}  // namespace km
