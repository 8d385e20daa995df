#include "apps/robot/recorder_node.hpp"

namespace km {
namespace {

constexpr std::size_t kQueueCapacity = 4096;  // far more than a module publishes in a second

}  // namespace

RecorderNode::RecorderNode(RobotId robot)
    : record_(robot),
      worker_(
          kQueueCapacity, Overflow::kBlock,
          [this](const Input& apply) {
            const std::lock_guard lock(mutex_);
            apply();
          },
          "recorder") {}

}  // namespace km
