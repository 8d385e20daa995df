#include "modules/recorded_graph/node/graph_playback_node.hpp"

#include <cmath>
#include <condition_variable>
#include <mutex>
#include <stdexcept>
#include <string>
#include <utility>

#include "modules/core/geometry/lie.hpp"
#include "runtime/clock.hpp"
#include "runtime/log.hpp"

namespace km {
namespace {

std::vector<std::vector<RelativePose>> closures_by_keyframe(const RecordedGraph& graph) {
  std::vector<std::vector<RelativePose>> closures(graph.poses());
  for (const RelativePose& closure : graph.intra_closures)
    closures[std::max(closure.from.index, closure.to.index)].push_back(closure);
  for (const RelativePose& closure : graph.inter_closures)
    if (closure.from.robot == graph.robot) closures[closure.from.index].push_back(closure);
  return closures;
}

double checked_rate(double rate) {
  if (rate > 0.0) return rate;
  throw std::invalid_argument("GraphPlaybackNode: rate " + std::to_string(rate) +
                              " is not positive");
}

// Restores orthonormality, which a long product of rotations loses by rounding.
SE3 orthonormal(const SE3& T) {
  return make_pose(nearest_rotation(T.linear()), T.translation());
}

}  // namespace

GraphPlaybackNode::GraphPlaybackNode(const GraphPlaybackConfig& config, double rate,
                                     RecordedGraph graph, const GraphPlaybackTopics& topics)
    : WorkerNode({.name = GraphPlaybackConfig::kSection}),
      poses_per_second_(checked(config).poses_per_second),
      rate_(checked_rate(rate)),
      graph_(std::move(graph)),
      topics_(topics),
      closures_of_(closures_by_keyframe(graph_)) {}

void GraphPlaybackNode::start_sources() {
  begin_ = Clock::now();
  post(0);
}

void GraphPlaybackNode::handle(const std::size_t& index) {
  wait_until_due(index);
  if (stop_.stop_requested()) return;
  step(index);
  if (index + 1 < graph_.poses()) post(index + 1);  // the queue is empty and has room for one
}

void GraphPlaybackNode::wait_until_due(std::size_t index) {
  if (std::isinf(rate_) || index < known_) return;
  const double due_s = seconds_between(stamp_of(known_), stamp_of(index)) / rate_;
  const Heartbeat::Waiting waiting;
  std::mutex unused_mutex;  // needed by wait_until(); no other thread locks it
  std::condition_variable_any due_or_stopped;
  std::unique_lock lock(unused_mutex);
  due_or_stopped.wait_until(lock, stop_.get_token(), begin_ + steady_duration(due_s),
                            [] { return false; });
}

Stamp GraphPlaybackNode::stamp_of(std::size_t index) const {
  if (!graph_.stamps.empty()) return graph_.stamps[index];
  return nanoseconds(static_cast<double>(index) / poses_per_second_);
}

void GraphPlaybackNode::step(std::size_t index) {
  KeyframeOdometry odometry;
  odometry.id = {graph_.robot, static_cast<std::uint32_t>(index)};
  odometry.stamp = stamp_of(index);
  if (const auto vertical = graph_.verticals.find(odometry.id.index);
      vertical != graph_.verticals.end())
    odometry.vertical = vertical->second;
  if (index == 0) {
    T_odom_kf_.T = odometry.T_previous_kf = graph_.T_odom_first();
  } else {
    const RelativePose& last_step = graph_.odometry[index - 1];
    odometry.T_previous_kf = last_step.T_from_to;
    odometry.covariance = last_step.covariance;
    T_odom_kf_ = compose(T_odom_kf_, {last_step.T_from_to, last_step.covariance});
    T_odom_kf_.T = orthonormal(T_odom_kf_.T);
  }
  odometry.T_odom_kf = T_odom_kf_.T;
  Keyframe keyframe;
  keyframe.odometry = {odometry.id, T_odom_kf_.T, T_odom_kf_.Sigma};
  keyframe.stamp = odometry.stamp;
  if (index >= known_) {
    topics_.odometry.publish(std::move(odometry));
    topics_.keyframes.publish(std::move(keyframe));
  }
  for (const RelativePose& closure : closures_of_[index]) topics_.closures.publish(closure);

  ++published_.keyframes;
  published_.closures += closures_of_[index].size();
  if (index + 1 < graph_.poses()) return;
  log::info(name()) << "end of graph: " << published_.keyframes << " keyframes, "
                    << published_.closures << " closures";
  topics_.end(published_);
}

}  // namespace km
