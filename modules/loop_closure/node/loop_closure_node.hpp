#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <variant>
#include <vector>

#include "modules/core/data/keyframe.hpp"
#include "modules/core/data/pose_graph.hpp"
#include "modules/loop_closure/keyframe_requests.hpp"
#include "modules/loop_closure/peer_words.hpp"
#include "modules/loop_closure/request_policy.hpp"
#include "modules/loop_closure/verifier.hpp"
#include "modules/place_recognition/bag_of_words.hpp"
#include "modules/place_recognition/vocabulary.hpp"
#include "runtime/dds/bridge.hpp"
#include "runtime/worker_node.hpp"

namespace km {

/// Channels of the loop closure node; they must outlive it.
struct LoopClosureTopics {
  In<Keyframe> keyframes;              ///< Keyframes of this robot.
  In<LoopCandidate> candidates;        ///< Pairs that may show the same place.
  In<RelativePose> measured_closures;  ///< Closures of a recorded graph that start at this robot.
  In<KeyframeRequest> peer_requests;   ///< Requests of peers for keyframes of this robot.
  In<KeyframeReply> peer_replies;      ///< Replies of peers to requests of this robot.
  In<KeyframeWords> peer_words;        ///< Replies to requests for word points.
  In<Closure> peer_closures;           ///< Closures that peers have verified.
  In<PeerEvent> peer_events;           ///< Beginning and end of links to peers.
  In<PeerEvent> restarts;              ///< kRestarted, before the first candidate of the new
                                       ///< incarnation.
  In<KeyframeBow> peer_bows;           ///< Words of the peers' keyframes.
  In<ClosureOutcome> restored;         ///< Outcomes of candidates from an earlier process of this
                                       ///< robot.
  Out<Addressed<KeyframeRequest>> own_requests;
  Out<Addressed<KeyframeReply>> own_replies;
  Out<Addressed<KeyframeWords>> own_words;
  Out<Closure> own_closures;     ///< Verified closures of this robot.
  Out<PeerEvent> own_restarts;   ///< kRestarted, after the last closure with a keyframe from before
                                 ///< the restart.
  Out<ClosureOutcome> outcomes;  ///< Published whenever a candidate reaches a further stage or
                                 ///< stops.
};

/// Clock tick at which due requests are sent.
struct LoopClosureTick {
  double now_s = steady_now_s();  ///< Clock with any origin, not decreasing.
};

using LoopClosureInput =
    std::variant<LoopClosureTick, std::shared_ptr<const Keyframe>,
                 std::shared_ptr<const LoopCandidate>, std::shared_ptr<const RelativePose>,
                 std::shared_ptr<const KeyframeRequest>, std::shared_ptr<const KeyframeReply>,
                 std::shared_ptr<const KeyframeWords>, std::shared_ptr<const Closure>,
                 std::shared_ptr<const PeerEvent>, std::shared_ptr<const KeyframeBow>,
                 std::shared_ptr<const ClosureOutcome>>;

/// Turns candidates into verified closures (Chang et al., "Kimera-Multi", Sec. III-A). The node
/// requests the keyframes of peers from their owners, verifies the candidates, and publishes the
/// closures. A candidate is never dropped because a reply is missing, but not every candidate is
/// worth a request (see RequestPolicy). The first request is for WordPoints, because most
/// candidates show other places. The descriptors of these points are requested only if the points
/// agree with an own keyframe. Measured closures are processed in the same way, but without
/// RequestPolicy and without verification: only the odometry of the peer's keyframe is used. The
/// node also replies to the peers' requests for own keyframes.
///
/// A closure starts at an own keyframe: `from` is the candidate's match, `to` the candidate's
/// query. The node verifies each pair once. The other robot may find the pair too, with the ends
/// exchanged. It verifies the pair only if both begin at the same time.
///
/// When a robot has restarted, its keyframe indices mean other keyframes. The node then drops all
/// candidates and measured closures with this robot, and begins again.
class LoopClosureNode final : public WorkerNode<LoopClosureInput> {
 public:
  /// Reads an own keyframe from the disk; null if it is not there. Called on any thread.
  using ReadKeyframe = std::function<std::shared_ptr<const Keyframe>(KeyframeIndex)>;

  /// Bound for a closure inside a robot, in place of LoopClosureConfig::max_rotation_sigma_rad if
  /// it is smaller: odometry and other closures join such keyframes, too.
  static constexpr double kMaxOwnRotationSigma_rad = 0.015;

  /// If `vocabulary` is null, the choice of keypoints does not depend on words. Without
  /// `read_keyframe`, older own keyframes stay in memory with some of their keypoints. Throws
  /// ConfigError if `config` is out of bounds.
  LoopClosureNode(const LoopClosureConfig& config, RobotId self,
                  std::shared_ptr<const Vocabulary> vocabulary, const LoopClosureTopics& topics,
                  ReadKeyframe read_keyframe = {});
  ~LoopClosureNode() override { stop(); }

  /// Handle one input synchronously. The thread calls only these functions; tests and replay can
  /// call them too.
  void step(const std::shared_ptr<const Keyframe>& own_keyframe);
  void step(const std::shared_ptr<const LoopCandidate>& candidate);
  void step(const std::shared_ptr<const RelativePose>& measured_closure);
  void step(const std::shared_ptr<const KeyframeRequest>& request);
  void step(const std::shared_ptr<const KeyframeReply>& reply);
  void step(const std::shared_ptr<const KeyframeWords>& words);
  void step(const std::shared_ptr<const Closure>& peer_closure);
  void step(const std::shared_ptr<const PeerEvent>& event);
  void step(const std::shared_ptr<const KeyframeBow>& bow);
  void step(const std::shared_ptr<const ClosureOutcome>& restored);
  void step(const LoopClosureTick& tick);

 private:
  using KeyframePtr = std::shared_ptr<const Keyframe>;

  /// A candidate or a measured closure that is not finished.
  struct Work {
    ClosureId id;
    double similarity = 0.0;
    int support = 1;                            ///< LoopCandidate::support.
    std::optional<RelativePose> measured = {};  ///< Measured closure; empty for a candidate.
    bool requested = false;                     ///< The keyframe of the peer has been requested.
  };

  void handle(const Input& input) override {
    std::visit([this](const auto& message) { step(message); }, input);
  }
  void evict_before(KeyframeIndex newest);
  [[nodiscard]] KeyframePtr own(const KeyframeId& id) const;
  void forget(RobotId peer);
  void accept(const Work& work);
  bool advance(const Work& work);
  void request_keyframe(const KeyframeId& missing, const Work& work);
  void arrived(const KeyframePtr& keyframe);
  bool withdraw_near_closures(const KeyframeId& missing);
  [[nodiscard]] bool fits(const Work& work, const WordPoints& theirs) const;
  [[nodiscard]] KeyframePart part_to_request(const KeyframeId& keyframe) const;
  KeyframePtr find(const KeyframeId& id);
  bool complete(const Work& work, const Keyframe& from, const Keyframe& to);
  void report(const Work& work, ClosureStage stage, std::string reason = {},
              const Verification& numbers = {}) const;
  void send_due_requests();

  const LoopClosureConfig config_;
  const RobotId self_;
  const std::shared_ptr<const Vocabulary> vocabulary_;
  const LoopClosureTopics topics_;
  const Verifier verifier_;
  const ReadKeyframe read_keyframe_;
  std::map<KeyframeId, KeyframePtr> own_;  // own keyframes; null if stored on the disk
  PeerWords words_;
  KeyframeCache peers_;
  KeyframeRequests requests_;
  RequestPolicy policy_;
  const std::size_t reply_keypoints_;
  const KeyframeIndex full_keyframes_;
  // Keyframes whose word points agree: their features are requested. Without points: as a whole.
  std::map<KeyframeId, WordPoints> promising_;
  std::map<KeyframeId, std::vector<Work>> waiting_;  // work by the keyframe that is missing
  std::set<ClosureId> known_;                        // candidates and measured closures seen
  double now_s_ = 0.0;
  std::uint32_t next_request_ = 0;
};

}  // namespace km
