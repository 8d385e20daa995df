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

/// Progress of a robot in its input: time from the first stamp to the latest. Thread-safe.
class InputTime {
 public:
  void reach(Stamp stamp) {
    const std::lock_guard lock(mutex_);
    if (!first_) first_ = last_ = stamp;
    last_ = std::max(last_, stamp);
  }

  /// [s]; 0 before the first stamp.
  [[nodiscard]] double seconds() const {
    const std::lock_guard lock(mutex_);
    return first_ ? seconds_between(*first_, last_) : 0.0;
  }

 private:
  mutable std::mutex mutex_;
  std::optional<Stamp> first_;
  Stamp last_ = 0;
};

/// The progress of a robot, as it shows it to the others and to viewers. Thread-safe.
class Progress {
 public:
  Progress(RobotCore& core, const Places& places);

  [[nodiscard]] double input_s() const { return input_time_.seconds(); }
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
  void take(const Topic<OptimizerProgress>::Message& progress);

  RobotCore& core_;
  const Node* const locator_;
  InputTime input_time_;
  std::atomic<std::uint32_t> keyframes_ = 0;
  std::atomic<std::uint8_t> settled_links_ = 0;
  mutable std::mutex mutex_;  // guards the rest
  Topic<OptimizerProgress>::Message optimizer_;
  bool is_apart_ = false;  // not yet located
  std::optional<double> located_after_s_;
  std::map<RobotId, double> received_s_;  // time of the last status, by the steady clock
};

}  // namespace km
