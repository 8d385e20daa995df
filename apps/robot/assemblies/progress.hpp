#pragma once

#include <atomic>
#include <map>
#include <mutex>
#include <optional>

#include "apps/robot/assemblies/places.hpp"
#include "apps/robot/assemblies/robot_core.hpp"
#include "apps/robot/run_end.hpp"
#include "modules/core/data/robot_sample.hpp"

namespace km {

/// The progress of a robot, as it shows it to the others and to viewers. Thread-safe.
class Progress {
 public:
  Progress(RobotCore& core, const Places& places);

  /// Time from the first stamp of the input to the latest [s]; 0 before the first.
  [[nodiscard]] double input_s() const {
    const std::lock_guard lock(mutex_);
    return seconds_between(first_.value_or(last_), last_);
  }
  /// Time in the input at which closures tied this run to the map, or fixes determined the absolute
  /// frame; absent before.
  [[nodiscard]] std::optional<double> located_after_s() const {
    const std::lock_guard lock(mutex_);
    return located_after_s_;
  }
  /// The newest state of the optimiser; null before the first.
  [[nodiscard]] Topic<OptimizerProgress>::Message optimizer() const {
    const std::lock_guard lock(mutex_);
    return optimizer_;
  }
  void set_settled(const Departure::Present& reported) {
    core_.phase = reported.phase;
    settled_links_ = reported.settled_links;
  }
  [[nodiscard]] RobotStatus status(const OverlaySummary& overlay) const;
  /// Adds name, phase, keyframes, team and links.
  void add_to(RobotSample& sample) const;

 private:
  void reach(Stamp stamp);
  void take(const Topic<OptimizerProgress>::Message& progress);

  RobotCore& core_;
  const Node* const locator_;
  std::atomic<std::uint32_t> keyframes_ = 0;
  std::atomic<std::uint8_t> settled_links_ = 0;
  mutable std::mutex mutex_;    // guards the rest
  std::optional<Stamp> first_;  // stamps of the input
  Stamp last_ = 0;
  Topic<OptimizerProgress>::Message optimizer_;
  bool is_apart_ = false;  // not yet located
  std::optional<double> located_after_s_;
  std::map<RobotId, double> received_s_;  // time of the last status, by the steady clock
};

}  // namespace km
