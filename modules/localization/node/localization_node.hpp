#pragma once

#include <atomic>
#include <cstddef>
#include <exception>
#include <string_view>
#include <vector>

#include "modules/localization/map_matcher.hpp"
#include "runtime/node.hpp"
#include "runtime/topic.hpp"
#include "runtime/worker.hpp"

namespace km {

/// Channels of the localization node; they must outlive it.
struct LocalizationTopics {
  In<Keyframe> keyframes;  ///< Keyframes of this robot, ascending. Keyframe 0 is that of the map.
  Out<Closure> closures;   ///< Matches with the map, as closures from keyframe 0.
  Out<ClosureOutcome> outcomes;  ///< One for each keyframe with candidates.
};

/// Compares every keyframe of the robot with a finished map (MapMatcher), in a thread.
class LocalizationNode final : public Node {
 public:
  LocalizationNode(MapMatcher matcher, const LocalizationTopics& topics);

  std::string_view name() const override { return "localization"; }
  void start() override { worker_.start(); }
  void stop() noexcept override { worker_.stop(); }
  std::exception_ptr error() const override { return worker_.error(); }
  std::vector<Heartbeat*> heartbeats() override { return {&worker_.heartbeat()}; }
  DurationHistogram timing() const override { return worker_.timing(); }

  /// Handles one keyframe synchronously. The thread calls only this function; tests can call it
  /// too.
  void step(const Keyframe& keyframe);

  /// Number of keyframes that were compared, and of those that match. Thread-safe.
  [[nodiscard]] std::size_t compared() const { return compared_; }
  [[nodiscard]] std::size_t matched() const { return matched_; }

 private:
  MapMatcher matcher_;
  const LocalizationTopics topics_;
  std::atomic<std::size_t> compared_ = 0;
  std::atomic<std::size_t> matched_ = 0;
  Worker<Topic<Keyframe>::Message> worker_;  // last member: stops first
};

}  // namespace km
