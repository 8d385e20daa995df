#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <functional>
#include <vector>

#include "modules/core/data/covariance.hpp"
#include "modules/core/data/keyframe.hpp"
#include "modules/core/data/odometry.hpp"
#include "modules/core/data/pose_graph.hpp"
#include "modules/recorded_graph/graph_playback_config.hpp"
#include "modules/recorded_graph/recorded_graph.hpp"
#include "runtime/worker_node.hpp"

namespace km {

/// End of the recorded graph.
struct GraphPlaybackEnd {
  std::size_t keyframes = 0;
  std::size_t closures = 0;  ///< Number of closures that the node published.
};

/// Outputs of the playback. All topics must outlive the node.
struct GraphPlaybackTopics {
  Out<KeyframeOdometry> odometry;
  Out<Keyframe> keyframes;  ///< Without features; covariance relative to keyframe 0.
  Out<RelativePose> closures;
  /// Called once after everything else, unless the node is stopped earlier.
  std::function<void(const GraphPlaybackEnd&)> end;
};

/// Publishes the part of one robot of a recorded pose graph as if the robot were driving. It
/// publishes the keyframes in order, each followed by the closures that it makes known. A closure
/// inside the robot appears with the later of its keyframes. A closure between two robots is in the
/// records of both. The robot of its end `from` publishes it with its own keyframe, whether or not
/// the other robot has reached the other end. Verticals are published with their keyframes;
/// odometry then starts upright, see RecordedGraph::T_odom_first(). Keyframes have the stamps of
/// the graph. If the graph has none, keyframe i has the stamp i / poses_per_second.
class GraphPlaybackNode final : public WorkerNode<std::size_t> {
 public:
  /// `rate`: recorded seconds per second; infinity: as fast as the consumers accept messages.
  /// Throws ConfigError if `config` is out of bounds, std::invalid_argument for a bad rate.
  GraphPlaybackNode(const GraphPlaybackConfig& config, double rate, RecordedGraph graph,
                    const GraphPlaybackTopics& topics);

  /// Declares the first `keyframes` known, e.g. after a resume: the node publishes only their
  /// closures, without waiting. Call before start().
  void continue_after(std::size_t keyframes) { known_ = std::min(keyframes, graph_.poses()); }
  ~GraphPlaybackNode() override { stop(); }

  /// None, because steps wait until keyframes are due.
  DurationHistogram timing() const override { return {}; }

  /// Publishes keyframe `index` and its closures, without waiting, and after the last keyframe the
  /// end. Call with 0, 1, ... in turn. The thread only calls this function and waits.
  void step(std::size_t index);

 private:
  using Clock = std::chrono::steady_clock;

  void handle(const std::size_t& index) override;
  void start_sources() override;
  /// The node ends at once and publishes nothing that is not yet due.
  void stop_sources() noexcept override { stop_.request_stop(); }
  void wait_until_due(std::size_t index);
  [[nodiscard]] Stamp stamp_of(std::size_t index) const;

  const double poses_per_second_;
  const double rate_;
  const RecordedGraph graph_;
  const GraphPlaybackTopics topics_;
  // [i]: closures published with keyframe i. Keyframe i is the later end of a closure inside the
  // robot, or the end `from` of a closure between robots.
  std::vector<std::vector<RelativePose>> closures_of_;
  UncertainPose T_odom_kf_;  // pose of the last keyframe that was published or is known
  GraphPlaybackEnd published_;
  std::size_t known_ = 0;  // number of known keyframes
  Clock::time_point begin_;
  std::stop_source stop_;
};

}  // namespace km
