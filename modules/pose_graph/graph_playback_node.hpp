#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <exception>
#include <stop_token>
#include <string_view>
#include <vector>

#include "modules/core/covariance.hpp"
#include "modules/core/keyframe.hpp"
#include "modules/core/odometry.hpp"
#include "modules/core/pose_graph.hpp"
#include "modules/pose_graph/graph_playback_config.hpp"
#include "modules/pose_graph/recorded_graph.hpp"
#include "runtime/node.hpp"
#include "runtime/topic.hpp"
#include "runtime/worker.hpp"

namespace km {

/// The recorded graph is over; published once, after everything else. Not published by a stop
/// before.
struct GraphPlaybackEnd {
  std::size_t keyframes = 0;
  std::size_t closures = 0;  ///< Published by this robot.
};

/// Where a played graph goes. All topics must outlive the node.
struct GraphPlaybackTopics {
  Out<KeyframeOdometry> odometry;
  Out<Keyframe> keyframes;  ///< Without features; covariance since keyframe 0.
  Out<RelativePose> closures;
  Out<GraphPlaybackEnd> end;
};

/// Plays one robot's part of a recorded pose graph as if it were being driven: keyframe after
/// keyframe, each followed by the closures that it makes known. A closure inside the robot appears
/// with the later of its keyframes. One between two robots is in the records of both: the robot it
/// starts `from` publishes it, with its own keyframe, be the other robot there yet or not.
/// Verticals go with their keyframes; with them odometry starts upright, see
/// RecordedGraph::T_odom_first(). Keyframes have the stamps of the graph; if it has none, keyframe
/// i is at i / poses_per_second.
class GraphPlaybackNode final : public Node {
 public:
  /// `rate`: recorded seconds per second; infinity: as fast as consumers take it.
  /// Throws ConfigError if `config` is out of bounds, std::invalid_argument for a bad rate.
  GraphPlaybackNode(const GraphPlaybackConfig& config, double rate, RecordedGraph graph,
                    const GraphPlaybackTopics& topics);

  /// The first `keyframes` are known: of those only the closures are played, and at once. Call
  /// before start().
  void continue_after(std::size_t keyframes) { known_ = std::min(keyframes, graph_.poses()); }
  ~GraphPlaybackNode() override { stop(); }

  std::string_view name() const override { return GraphPlaybackConfig::kSection; }
  void start() override;
  /// Ends at once: what is not yet due has not happened.
  void stop() noexcept override;
  std::exception_ptr error() const override { return worker_.error(); }
  std::vector<Heartbeat*> heartbeats() override { return {&worker_.heartbeat()}; }

  /// Publishes keyframe `index` and what it makes known, without waiting; the end after the last.
  /// Call with 0, 1, ... in turn. The thread calls only this and waits.
  void step(std::size_t index);

 private:
  using Clock = std::chrono::steady_clock;

  void play(std::size_t index);
  void wait_until_due(std::size_t index);
  [[nodiscard]] Stamp stamp_of(std::size_t index) const;

  const double poses_per_second_;
  const double rate_;
  const RecordedGraph graph_;
  const GraphPlaybackTopics topics_;
  std::vector<std::vector<RelativePose>> closures_of_;  // those that keyframe i makes known
  UncertainPose T_odom_kf_;                             // of the last keyframe published
  GraphPlaybackEnd published_;
  std::size_t known_ = 0;  // keyframes
  Clock::time_point begin_;
  std::stop_source stop_;
  Worker<std::size_t> worker_;  // last member: stops first; posts itself the next keyframe
};

}  // namespace km
