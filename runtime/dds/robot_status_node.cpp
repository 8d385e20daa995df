#include "runtime/dds/robot_status_node.hpp"

#include <chrono>
#include <utility>

namespace km {

RobotStatusNode::RobotStatusNode(std::function<RobotStatus()> provider,
                                 const RobotStatusTopics& topics)
    : periodic_(
          std::chrono::milliseconds(500),
          [provider = std::move(provider), own = topics.own] { own.publish(provider()); },
          "robot_status") {
  topics.peers.subscribe([this](const Topic<RobotStatus>::Message& status) {
    const std::lock_guard lock(mutex_);
    latest_[status->robot] = *status;
  });
}

std::vector<RobotStatus> RobotStatusNode::peers() const {
  const std::lock_guard lock(mutex_);
  std::vector<RobotStatus> result;
  for (const auto& [robot, status] : latest_) result.push_back(status);
  return result;
}

}  // namespace km
