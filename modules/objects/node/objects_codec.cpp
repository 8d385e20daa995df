#include "modules/objects/node/objects_codec.hpp"

#include <utility>

#include "runtime/dds/wire_pose.hpp"

namespace km {
namespace {

constexpr float kMaxSize_m = 1e5F, kMaxSurface_m2 = 1e9F;

// Written so that NaN fails.
bool is_size(float value, float most) {
  return value >= 0.0F && value <= most;
}

}  // namespace

Codec<RobotObjects>::Encoded Codec<RobotObjects>::encode(const RobotObjects& objects) {
  Encoded encoded;
  for (const AnchoredObject& object : objects.objects) {
    const Eigen::Vector3f size = object.size_m.cast<float>();
    encoded.objects.push_back({.layer = static_cast<std::uint8_t>(object.layer),
                               .label = object.label,
                               .keyframe = object.keyframe,
                               .T_kf_box = to_wire(object.T_kf_box),
                               .T_world_kf = to_wire(object.T_world_kf),
                               .size_m = {size.x(), size.y(), size.z()},
                               .surface_m2 = static_cast<float>(object.surface_m2),
                               .views = object.views});
  }
  encoded.wire.anchor = objects.anchor;
  for (const SurfaceKeyframe& keyframe : objects.keyframes)
    encoded.keyframes.push_back(
        {.odometry = to_wire(keyframe.odometry), .T_world_kf = to_wire(keyframe.T_world_kf)});
  borrow(encoded.wire.objects, encoded.objects);
  borrow(encoded.wire.keyframes, encoded.keyframes);
  return encoded;
}

Decoded<RobotObjects> Codec<RobotObjects>::decode(const Wire& wire, const TeamPeer& writer) {
  using Result = Decoded<RobotObjects>;
  const auto objects = elements_of(wire.objects, kMaxObjects);
  if (!objects) return Result::refuse("objects are missing or too many");
  const auto keyframes = elements_of(wire.keyframes, kMaxObjectKeyframes);
  if (!keyframes) return Result::refuse("keyframes of objects are missing or too many");
  RobotObjects result{
      .robot = writer.robot, .boot = writer.boot, .anchor = wire.anchor, .objects = {}};
  for (const km_wire_SurfaceKeyframe& keyframe : *keyframes) {
    const auto odometry = from_wire(keyframe.odometry);
    const auto T_world_kf = from_wire(keyframe.T_world_kf);
    if (!odometry || !T_world_kf || odometry->id.robot != writer.robot)
      return Result::refuse("a keyframe of objects has no pose or is of another robot");
    result.keyframes.push_back({*odometry, *T_world_kf});
  }
  for (const km_wire_SceneObject& object : *objects) {
    if (object.layer != static_cast<std::uint8_t>(SceneLayer::kObject)) continue;
    const auto T_kf_box = from_wire(object.T_kf_box);
    const auto T_world_kf = from_wire(object.T_world_kf);
    if (!T_kf_box || !T_world_kf) return Result::refuse("a pose of an object is none");
    const auto& [x, y, z] = object.size_m;
    if (!is_size(x, kMaxSize_m) || !is_size(y, kMaxSize_m) || !is_size(z, kMaxSize_m) ||
        !is_size(object.surface_m2, kMaxSurface_m2))
      return Result::refuse("an object has no usable size");
    result.objects.push_back({.layer = SceneLayer::kObject,
                              .label = object.label,
                              .keyframe = object.keyframe,
                              .T_kf_box = *T_kf_box,
                              .T_world_kf = *T_world_kf,
                              .size_m = {x, y, z},
                              .surface_m2 = object.surface_m2,
                              .views = object.views});
  }
  return Result::accept(std::move(result));
}

}  // namespace km
