#pragma once

#include <atomic>
#include <cstdint>
#include <map>
#include <mutex>

#include "apps/robot/assemblies/robot_core.hpp"
#include "modules/outlier_rejection/node/pcm_node.hpp"
#include "runtime/overlay/overlay_node.hpp"

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

/// From closures to the trajectory in the team's frame, and the messages for that between robots.
class BackEnd {
 public:
  /// `dimension`: 2 or 3, of the poses. `map`: see Places::map_id().
  BackEnd(RobotCore& core, const RobotConfig& config, int dimension, std::uint64_t map);

  /// Reports that no robot will find another closure.
  void expect_no_more_closures() { pcm_->expect_no_more(); }
  [[nodiscard]] OverlaySummary overlay() const { return overlay_->summary(); }
  /// True if another running robot had this robot's id first.
  [[nodiscard]] bool id_taken() const { return id_taken_; }

 private:
  void add_solver(const RobotConfig& config, int dimension, std::uint64_t map);
  void add_overlay();
  void add_crossings();
  void address_closures();

  RobotCore& core_;
  IncarnationsMet incarnations_;
  PcmNode* pcm_ = nullptr;
  OverlayNode* overlay_ = nullptr;
  std::atomic<bool> id_taken_ = false;
};

}  // namespace km
