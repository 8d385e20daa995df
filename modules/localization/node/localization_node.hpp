#pragma once

#include <atomic>
#include <cstddef>

#include "modules/localization/map_matcher.hpp"
#include "runtime/worker_node.hpp"

namespace km {

/// Channels of the localization node; they must outlive it.
struct LocalizationTopics {
  In<Keyframe> keyframes;  ///< Keyframes of this robot, ascending. Keyframe 0 is that of the map.
  Out<Closure> closures;   ///< Matches with the map, as closures from keyframe 0.
  Out<ClosureOutcome> outcomes;  ///< One for each keyframe with candidates.
};

/// Compares every keyframe of the robot with a finished map (MapMatcher), in a thread.
class LocalizationNode final : public WorkerNode<Topic<Keyframe>::Message> {
 public:
  LocalizationNode(MapMatcher matcher, const LocalizationTopics& topics);
  ~LocalizationNode() override { stop(); }

  /// Handles one keyframe synchronously. The thread calls only this function; tests can call it
  /// too.
  void step(const Keyframe& keyframe);

  /// Number of keyframes that were compared, and of those that match. Thread-safe.
  [[nodiscard]] std::size_t compared() const { return compared_; }
  [[nodiscard]] std::size_t matched() const { return matched_; }

 private:
  void handle(const Topic<Keyframe>::Message& keyframe) override { step(*keyframe); }

  MapMatcher matcher_;
  const LocalizationTopics topics_;
  std::atomic<std::size_t> compared_ = 0;
  std::atomic<std::size_t> matched_ = 0;
};

}  // namespace km
