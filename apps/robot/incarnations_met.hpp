#pragma once

#include <cstdint>
#include <map>
#include <mutex>

#include "modules/core/robot_identity.hpp"

namespace km {

/// For each other robot, the incarnation with which this robot has closures. Thread-safe.
class IncarnationsMet {
 public:
  /// Later closures with `peer` belong to its present incarnation.
  void meet(const TeamPeer& peer) {
    const std::lock_guard lock(mutex_);
    boots_[peer.robot] = peer.boot;
  }

  /// A boot id of the incarnation; 0 if the robot has not been met.
  [[nodiscard]] std::uint64_t of(RobotId robot) const {
    const std::lock_guard lock(mutex_);
    const auto found = boots_.find(robot);
    return found == boots_.end() ? 0 : found->second;
  }

 private:
  mutable std::mutex mutex_;  // guards boots_
  std::map<RobotId, std::uint64_t> boots_;
};

}  // namespace km
