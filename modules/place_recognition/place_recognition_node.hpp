#pragma once

#include <exception>
#include <map>
#include <memory>
#include <optional>
#include <string_view>
#include <variant>
#include <vector>

#include "modules/core/covariance.hpp"
#include "modules/core/keyframe.hpp"
#include "modules/core/pose_graph.hpp"
#include "modules/place_recognition/bag_of_words.hpp"
#include "modules/place_recognition/candidate_filter.hpp"
#include "modules/place_recognition/peer_history.hpp"
#include "modules/place_recognition/vocabulary.hpp"
#include "runtime/dds/peer_table.hpp"
#include "runtime/node.hpp"
#include "runtime/topic.hpp"
#include "runtime/worker.hpp"

namespace km {

/// Channels of the place recognition node; they must outlive it.
struct PlaceRecognitionTopics {
  In<Keyframe> keyframes;     ///< Own, ascending.
  In<KeyframeBow> peer_bows;  ///< Bags of peers; own ones that return are ignored.
  In<PeerEvent> peer_events;  ///< Restarts after which keyframe indices of a peer mean other
                              ///< keyframes.
  Out<KeyframeBow> own_bows;  ///< Every own keyframe, for the peers.
  Out<LoopCandidate> candidates;
  Out<PeerEvent> restarts;  ///< kRestarted, after the last candidate with a keyframe from before.
  Out<PlaceQuery> queries;  ///< One per received keyframe.
};

/// Finds places that were seen before. It searches own keyframes among earlier own ones, and
/// keyframes of peers, as they arrive, among own ones (Chang et al., "Kimera-Multi", Sec. III-A).
///
/// A pair of keyframes (a_i, b_j) of two robots is never missed while messages arrive in both
/// directions. If a knew a_i when b_j arrived, a finds the pair. Otherwise a_i was published after
/// b_j, and b, which knows b_j, finds it. Both find it if the two messages crossed: keyframes of
/// the same instant, and all earlier ones when robots meet again. So receivers of candidates must
/// accept a pair from either side. Keyframe 0 of a robot has no normaliser and is found only as the
/// earlier keyframe.
///
/// A keyframe index means one keyframe during an incarnation of its robot. After a restart its
/// history begins again.
class PlaceRecognitionNode final : public Node {
 public:
  /// Throws ConfigError if `config` is out of bounds.
  PlaceRecognitionNode(const PlaceRecognitionConfig& config, RobotId self,
                       std::shared_ptr<const Vocabulary> vocabulary,
                       const PlaceRecognitionTopics& topics);

  std::string_view name() const override { return "place_recognition"; }
  void start() override { worker_.start(); }
  void stop() noexcept override { worker_.stop(); }
  std::exception_ptr error() const override { return worker_.error(); }
  std::vector<Heartbeat*> heartbeats() override { return {&worker_.heartbeat()}; }
  DurationHistogram timing() const override { return worker_.timing(); }

  /// Handle one input synchronously. The thread calls only these; so can tests and replay.
  void step(const Keyframe& keyframe);
  void step(const KeyframeBow& peer_bow);
  void step(const Topic<PeerEvent>::Message& event);

 private:
  using Input = std::variant<Topic<Keyframe>::Message, Topic<KeyframeBow>::Message,
                             Topic<PeerEvent>::Message>;

  void handle(const Input& input);

  void publish(const KeyframeId& query, CandidateSearch search) const;
  void publish_refusal(const KeyframeId& query, PlaceQueryStatus status) const;

  const PlaceRecognitionConfig config_;
  const RobotId self_;
  const std::shared_ptr<const Vocabulary> vocabulary_;
  const PlaceRecognitionTopics topics_;
  CandidateFilter own_;
  std::optional<UncertainPose> chain_;  // up to the keyframe before
  std::vector<KeyframeId> own_ids_;     // keyframe ids in the order of own_
  std::map<RobotId, PeerHistory> peers_;
  Worker<Input> worker_;  // last member: stops first
};

}  // namespace km
