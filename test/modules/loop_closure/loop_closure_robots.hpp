#pragma once

#include <deque>
#include <memory>
#include <utility>
#include <vector>

#include "modules/loop_closure/node/loop_closure_node.hpp"
#include "test/modules/loop_closure/synthetic_keyframes.hpp"
#include "test/modules/place_recognition/toy_vocabulary.hpp"

namespace km {

inline constexpr RobotId kSelf = 3;
inline constexpr RobotId kPeer = 9;

/// A robot's node with its channels; its messages are kept.
struct Robot {
  explicit Robot(RobotId self, const LoopClosureConfig& config = {},
                 LoopClosureNode::ReadKeyframe read_keyframe = {})
      : node(config, self, std::make_shared<const Vocabulary>(toy_vocabulary(200)),
             {.keyframes = keyframes,
              .candidates = candidates,
              .measured_closures = measured,
              .peer_requests = peer_requests,
              .peer_replies = peer_replies,
              .peer_words = peer_words,
              .peer_closures = peer_closures,
              .peer_events = peer_events,
              .restarts = restarts,
              .peer_bows = peer_bows,
              .restored = restored,
              .own_requests = own_requests,
              .own_replies = own_replies,
              .own_words = own_words,
              .own_closures = own_closures,
              .own_restarts = own_restarts,
              .outcomes = outcomes},
             std::move(read_keyframe)) {
    own_requests.subscribe([this](const auto& m) { requests.push_back(*m); });
    own_replies.subscribe([this](const auto& m) { replies.push_back(*m); });
    own_words.subscribe([this](const auto& m) { words.push_back(*m); });
    own_closures.subscribe([this](const auto& m) { closures.push_back(*m); });
    outcomes.subscribe([this](const auto& m) { reports.push_back(*m); });
  }

  template <typename T>
  void give(T message) {
    node.step(std::make_shared<const T>(std::move(message)));
  }
  void tick(double now_s) { node.step(LoopClosureTick{now_s}); }

  Topic<Keyframe> keyframes;
  Topic<LoopCandidate> candidates;
  Topic<RelativePose> measured;
  Topic<KeyframeRequest> peer_requests;
  Topic<KeyframeReply> peer_replies;
  Topic<KeyframeWords> peer_words;
  Topic<Closure> peer_closures;
  Topic<PeerEvent> peer_events, restarts, own_restarts;
  Topic<KeyframeBow> peer_bows;
  Topic<ClosureOutcome> restored;
  Topic<Addressed<KeyframeRequest>> own_requests;
  Topic<Addressed<KeyframeReply>> own_replies;
  Topic<Addressed<KeyframeWords>> own_words;
  Topic<Closure> own_closures;
  Topic<ClosureOutcome> outcomes;
  std::deque<Addressed<KeyframeRequest>> requests;
  std::deque<Addressed<KeyframeReply>> replies;
  std::deque<Addressed<KeyframeWords>> words;
  std::vector<Closure> closures;
  std::vector<ClosureOutcome> reports;
  LoopClosureNode node;
};

/// Delivers the messages of both robots; a reply may produce further requests.
inline void deliver(Robot& a, Robot& b) {
  const auto has_sent = [](const Robot& robot) {
    return !robot.requests.empty() || !robot.replies.empty() || !robot.words.empty();
  };
  while (has_sent(a) || has_sent(b))
    for (auto [from, to] : {std::pair(&a, &b), std::pair(&b, &a)}) {
      const auto requests = std::exchange(from->requests, {});
      for (const auto& request : requests) to->node.step(request.message);
      const auto replies = std::exchange(from->replies, {});
      for (const auto& reply : replies) to->node.step(reply.message);
      const auto words = std::exchange(from->words, {});
      for (const auto& points : words) to->node.step(points.message);
    }
}

/// Keyframe 0 of the robot and 5 of its peer see the same place.
struct Scene {
  explicit Scene(unsigned seed) {
    std::mt19937 rng(seed);
    const KeyframePair pair = make_keyframe_pair(rng, 150, {0.7, 0.3}, 1.0);
    T_own_peer = pair.T_from_to;
    own.odometry = {{kSelf, 0}, random_pose(rng), random_covariance(rng, 0.1)};
    own.features = pair.from;
    peer.odometry = {{kPeer, 5}, random_pose(rng), random_covariance(rng, 0.1)};
    peer.features = pair.to;
  }
  LoopCandidate candidate() const { return {peer.odometry.id, own.odometry.id, 1.5}; }

  SE3 T_own_peer;
  Keyframe own, peer;
};

/// Equal descriptors of keypoint i of both keyframes, by a network.
inline void describe(Scene& scene, std::uint16_t own_network, std::uint16_t peer_network) {
  std::mt19937 rng(40);
  for (std::size_t i = 0; i < scene.own.features.keypoints.size(); ++i) {
    scene.own.features.matched.push_back(random_descriptor<MatchedDescriptor>(rng));
    scene.peer.features.matched.push_back(scene.own.features.matched.back());
  }
  scene.own.features.network = own_network;
  scene.peer.features.network = peer_network;
}

/// Both robots with the keyframes of a scene, before one of them knows of a candidate.
struct Meeting {
  explicit Meeting(const Scene& two_views) : scene(two_views) {
    robot.give(scene.own);
    peer.give(scene.peer);
  }
  explicit Meeting(unsigned seed) : Meeting(Scene(seed)) {}

  Scene scene;
  Robot robot{kSelf}, peer{kPeer};
};

/// Keypoint i of both keyframes has word i.
inline Scene scene_with_words(unsigned seed) {
  Scene scene(seed);
  for (std::uint32_t i = 0; i < scene.own.features.descriptors.size(); ++i)
    scene.own.features.descriptors[i] = scene.peer.features.descriptors[i] = toy_descriptor(i);
  return scene;
}

/// The peer knows the words of the robot's keyframe.
inline void tell_words(Meeting& meeting) {
  const Vocabulary vocabulary = toy_vocabulary(200);
  meeting.peer.give(KeyframeBow{.id = meeting.scene.own.odometry.id,
                                .vocabulary = vocabulary.id(),
                                .words = vocabulary.count(meeting.scene.own.features.descriptors)});
}

inline std::vector<ClosureStage> stages_of(const std::vector<ClosureOutcome>& reports) {
  std::vector<ClosureStage> stages;
  for (const ClosureOutcome& report : reports) stages.push_back(report.stage);
  return stages;
}

using enum ClosureStage;
using Stages = std::vector<ClosureStage>;

}  // namespace km
