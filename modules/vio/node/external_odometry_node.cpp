#include "modules/vio/node/external_odometry_node.hpp"

#include "runtime/log.hpp"

namespace km {
namespace {

// Capacity of the queue, as in VioNode. A full queue blocks the sensors. LoadShedding leaves out
// images before they are queued.
constexpr std::size_t kQueued = 4;

}  // namespace

ExternalOdometryNode::ExternalOdometryNode(RobotId robot, DepthSource depth_source,
                                           const VioConfig& config, const VioTopics& topics)
    : WorkerNode({.name = "odometry", .queue = kQueued}),
      odometry_(robot, depth_source, config),
      topics_(topics) {
  follow(topics.packets);
}

void ExternalOdometryNode::conclude() {
  log::info(name()) << images_ << " images, " << without_pose_ << " without a pose, " << jumps_
                    << " jumps";
}

void ExternalOdometryNode::step(const SensorPacket& packet) {
  const ExternalOdometryResult result = odometry_.process(packet);
  ++images_;
  if (!result.frame) ++without_pose_;
  if (result.has_jumped) {
    ++jumps_;
    log::limited(log::Level::kWarn, name(), "jump")
        << "at " << packet.frame->stamp << " ns: the odometry jumps faster than vio.max_speed_mps";
  }
  if (result.state) topics_.odometry.publish(*result.state);
  if (result.keyframe) topics_.keyframes.publish(*result.keyframe);
  if (result.frame) topics_.frames.publish(*result.frame);
  if (packet.frame == nullptr) return;
  topics_.images.publish(TrackedImage{packet.frame, {}});
  topics_.processed.publish(ProcessedFrame{packet.frame->stamp, std::nullopt});
}

}  // namespace km
