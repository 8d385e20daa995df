#include "modules/localization/node/localization_node.hpp"

#include <utility>

namespace km {
namespace {

// A minute of keyframes; a robot that is slower for longer delays the nodes before it.
constexpr std::size_t kQueueCapacity = 256;

}  // namespace

LocalizationNode::LocalizationNode(MapMatcher matcher, const LocalizationTopics& topics)
    : WorkerNode({.name = "localization", .queue = kQueueCapacity}),
      matcher_(std::move(matcher)),
      topics_(topics) {
  follow(topics.keyframes);
}

void LocalizationNode::step(const Keyframe& keyframe) {
  const KeyframeId id = keyframe.odometry.id;
  if (id.index == 0) return;
  MapMatch match = matcher_.match(keyframe);
  ++compared_;
  if (match.candidates == 0) return;
  const bool is_verified = match.closure.has_value();
  matched_ += is_verified ? 1 : 0;
  topics_.outcomes.publish(
      ClosureOutcome{.id = closure_id({id.robot, 0}, id),
                     .similarity = match.similarity,
                     .stage = is_verified ? ClosureStage::kVerified : ClosureStage::kReceived,
                     .reason = is_verified ? "" : to_string(match.verification.status),
                     .matches = match.verification.matches,
                     .inliers = match.verification.inliers});
  if (match.closure) topics_.closures.publish(*std::move(match.closure));
}

}  // namespace km
