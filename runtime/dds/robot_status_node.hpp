#pragma once

#include <functional>
#include <map>
#include <mutex>
#include <vector>

#include "runtime/dds/robot_status.hpp"
#include "runtime/node.hpp"
#include "runtime/periodic.hpp"
#include "runtime/topic.hpp"

namespace km {

/// Channels of the status node; they must outlive it.
struct RobotStatusTopics {
  Out<RobotStatus> own;
  In<RobotStatus> peers;
};

/// Publishes this robot's status twice a second and keeps the latest of each peer. Both topics
/// cross as kStatus: they carry the presence of the robots.
class RobotStatusNode final : public Node {
 public:
  /// `provider` is called on this node's thread.
  RobotStatusNode(std::function<RobotStatus()> provider, const RobotStatusTopics& topics);

  /// Latest of each robot heard of, ascending by id. Thread-safe.
  [[nodiscard]] std::vector<RobotStatus> peers() const;

  std::string_view name() const override { return "robot_status"; }
  void start() override { periodic_.start(); }
  void stop() noexcept override { periodic_.stop(); }
  std::exception_ptr error() const override { return periodic_.error(); }

 private:
  mutable std::mutex mutex_;  // guards latest_
  std::map<RobotId, RobotStatus> latest_;
  Periodic periodic_;  // last member: stops first
};

}  // namespace km
