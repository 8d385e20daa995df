#pragma once

#include <cstddef>

#include "modules/vio/external_odometry.hpp"
#include "modules/vio/node/vio_node.hpp"
#include "runtime/worker_node.hpp"

namespace km {

/// ExternalOdometry as a thread, in place of a VioNode.
class ExternalOdometryNode final : public WorkerNode<Topic<SensorPacket>::Message> {
 public:
  ExternalOdometryNode(RobotId robot, DepthSource depth_source, const VioConfig& config,
                       const VioTopics& topics);
  ~ExternalOdometryNode() override { stop(); }

  /// See ExternalOdometry. Call before start().
  void continue_from(const VioCheckpoint& checkpoint) { odometry_.continue_from(checkpoint); }

  void step(const SensorPacket& packet);

 private:
  void handle(const Topic<SensorPacket>::Message& packet) override { step(*packet); }
  void conclude() override;

  ExternalOdometry odometry_;
  const VioTopics topics_;
  std::size_t images_ = 0, without_pose_ = 0, jumps_ = 0;
};

}  // namespace km
