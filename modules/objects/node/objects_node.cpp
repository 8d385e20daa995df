#include "modules/objects/node/objects_node.hpp"

#include <string>
#include <utility>

#include "modules/objects/object_merging.hpp"
#include "runtime/log.hpp"

namespace km {
namespace {

// Larger than the number of messages during an extraction, so that no sender waits.
constexpr std::size_t kQueue = 4096;

// Shortest time between two messages with the objects of this robot, which has 150 bytes for each
// object and is sent only after changes.
constexpr double kPeriod_s = 5.0;

// Change of a box or of its keyframe that other robots are sent [m].
constexpr double kMinChange_m = 0.05;

}  // namespace

ObjectsNode::ObjectsNode(const ObjectsConfig& config, RobotId self, const LabelPalette& palette,
                         const ObjectsTopics& topics)
    // Subscribers of the joint objects write them to a disk, which may stall.
    : WorkerNode({.name = ObjectsConfig::kSection,
                  .queue = kQueue,
                  .tick_s = 1.0,
                  .in_background = true,
                  .step_limit_s = 300.0}),
      config_(checked(config)),
      self_(self),
      palette_(palette),
      labels_(object_labels(palette, config_.background)),
      own_(topics.own),
      joint_(topics.joint),
      team_(self, config_) {
  topics.meshes.subscribe([this](const auto& mesh) { latest_mesh_.put(mesh); });
  topics.trajectory.subscribe([this](const auto& newest) { latest_trajectory_.put(newest); });
  follow(topics.received);
}

void ObjectsNode::step(const Input& input, double now_s) {
  const auto* received = std::get_if<Topic<RobotObjects>::Message>(&input);
  if (received != nullptr) take(**received);
  if (const auto* keyframe = std::get_if<OdometryPose>(&input))
    keyframes_.insert_or_assign(keyframe->id.index, *keyframe);
  if (auto trajectory = latest_trajectory_.take()) {
    trajectory_ = std::move(trajectory);
    changed_ = true;
  }
  if (const auto mesh = latest_mesh_.take()) take(*mesh);
  send(now_s);
  if (!std::holds_alternative<Tick>(input) || !changed_ || trajectory_ == nullptr)
    return;  // published at the next tick
  changed_ = false;
  joint_.publish(team_.joint(*trajectory_));
}

void ObjectsNode::take(const OptimizedMesh& mesh) {
  const auto objects = merge_objects(
      extract_objects(mesh.mesh, mesh.origin.seen_by, self_, labels_, config_), config_);
  RobotObjects message = anchored(objects, *mesh.trajectory);
  if (objects.size() > kMaxObjects)
    log::limited(log::Level::kWarn, name(), "too many")
        << "the map has " << objects.size() << " objects; the smallest "
        << objects.size() - kMaxObjects << " are left out. objects.min_surface_m2 or "
        << "objects.background exclude more";
  message.keyframes = keyframes_of(message, keyframes_);
  (void)team_.add(message);
  changed_ = true;
  if (!last_sent_ || differ(message, *last_sent_, kMinChange_m)) to_send_ = std::move(message);
}

void ObjectsNode::take(const RobotObjects& received) {
  if (received.robot == self_ || !team_.add(received))
    log::limited(log::Level::kWarn, name(), std::to_string(received.robot))
        << "objects of robot " << received.robot << " are ignored: of an earlier boot";
  changed_ = true;
}

void ObjectsNode::send(double now_s) {
  if (!to_send_ || now_s < next_s_) return;
  next_s_ = now_s + kPeriod_s;
  last_sent_ = std::exchange(to_send_, std::nullopt);
  own_.publish(*last_sent_);
}

std::optional<ObjectList> ObjectsNode::finish(const std::optional<Trajectory>& trajectory) {
  if (const auto mesh = latest_mesh_.take()) take(*mesh);
  if (trajectory && !trajectory->T_world_kf.empty()) return team_.joint(*trajectory);
  return trajectory_ != nullptr ? std::optional(team_.joint(*trajectory_)) : std::nullopt;
}

}  // namespace km
