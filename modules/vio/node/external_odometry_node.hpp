#pragma once

#include <cstddef>
#include <exception>
#include <string_view>
#include <vector>

#include "modules/vio/external_odometry.hpp"
#include "modules/vio/node/vio_node.hpp"
#include "runtime/node.hpp"
#include "runtime/topic.hpp"
#include "runtime/worker.hpp"

namespace km {

/// ExternalOdometry as a thread, in place of a VioNode.
class ExternalOdometryNode final : public Node {
 public:
  ExternalOdometryNode(RobotId robot, DepthSource depth_source, const VioConfig& config,
                       const VioTopics& topics);
  ~ExternalOdometryNode() override { stop(); }

  /// See ExternalOdometry. Call before start().
  void continue_from(const VioCheckpoint& checkpoint) { odometry_.continue_from(checkpoint); }

  std::string_view name() const override { return "odometry"; }
  void start() override { worker_.start(); }
  /// Finishes queued packets and logs a summary.
  void stop() noexcept override;
  std::exception_ptr error() const override { return worker_.error(); }
  std::vector<Heartbeat*> heartbeats() override { return {&worker_.heartbeat()}; }
  DurationHistogram timing() const override { return worker_.timing(); }

  void step(const SensorPacket& packet);

 private:
  ExternalOdometry odometry_;
  const VioTopics topics_;
  std::size_t images_ = 0, without_pose_ = 0, jumps_ = 0;
  bool stopped_ = false;
  Worker<Topic<SensorPacket>::Message> worker_;  // last member: stops first
};

}  // namespace km
