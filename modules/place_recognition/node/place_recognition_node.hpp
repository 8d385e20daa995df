#pragma once

#include <map>
#include <memory>
#include <optional>
#include <set>
#include <variant>
#include <vector>

#include "modules/core/data/covariance.hpp"
#include "modules/core/data/keyframe.hpp"
#include "modules/core/data/pose_graph.hpp"
#include "modules/place_recognition/bag_of_words.hpp"
#include "modules/place_recognition/known_places.hpp"
#include "modules/place_recognition/place_database.hpp"
#include "modules/place_recognition/vocabulary.hpp"
#include "runtime/dds/peer_table.hpp"
#include "runtime/worker_node.hpp"

namespace km {

/// Channels of the place recognition node; they must outlive it.
struct PlaceRecognitionTopics {
  In<Keyframe> keyframes;     ///< Keyframes of this robot, ascending.
  In<KeyframeBow> peer_bows;  ///< Words of peers' keyframes; those of this robot are ignored.
  In<Closure> closures;       ///< Verified closures of this robot; only those between own keyframes
                              ///< are used.
  In<PeerEvent> peer_events;  ///< Only kRestarted is used: the peer's indices begin again at 0.
  Out<KeyframeBow> own_bows;  ///< Words of every own keyframe, for the peers; none if it is no view
                              ///< or shows a known place.
  Out<LoopCandidate> candidates;
  Out<PeerEvent> restarts;  ///< kRestarted, after the last candidate with a keyframe from before
                            ///< the restart.
  Out<PlaceQuery> queries;  ///< One per received keyframe.
};

/// Finds places that were seen before. The node compares each own keyframe with earlier own
/// keyframes, and each arriving keyframe of a peer with own keyframes (Chang et al.,
/// "Kimera-Multi", Sec. III-A).
///
/// A pair of keyframes (a_i, b_j) of two robots is never missed while messages arrive in both
/// directions. If a knew a_i when b_j arrived, a finds the pair. Otherwise a_i was published after
/// b_j, and b, which knows b_j, finds the pair. Both find the pair if the two messages crossed.
/// This happens for keyframes of the same instant, and for all earlier ones when robots meet again.
/// Receivers of candidates must therefore accept a pair from either side. Keyframe 0 of a robot has
/// no normaliser, so it occurs only as the match of a candidate.
///
/// An own keyframe that is no view (PlaceDatabase), or shows a known place (KnownPlaces), is
/// published without words and not searched by peers: an earlier keyframe stands for it. At a known
/// place, while a closure to it is due, its two most similar candidates are published, and
/// otherwise none.
///
/// A keyframe index means one keyframe during an incarnation of its robot. After a restart the
/// history of the robot begins again.
class PlaceRecognitionNode final
    : public WorkerNode<std::variant<Topic<Keyframe>::Message, Topic<KeyframeBow>::Message,
                                     Topic<Closure>::Message, Topic<PeerEvent>::Message>> {
 public:
  /// Throws ConfigError if `config` is out of bounds.
  PlaceRecognitionNode(const PlaceRecognitionConfig& config, RobotId self,
                       std::shared_ptr<const Vocabulary> vocabulary,
                       const PlaceRecognitionTopics& topics);
  ~PlaceRecognitionNode() override { stop(); }

  /// Handle one input synchronously. The thread calls only these functions; tests and replay can
  /// call them too.
  void step(const Keyframe& keyframe);
  void step(const KeyframeBow& peer_bow);
  void step(const Closure& closure);
  void step(const Topic<PeerEvent>::Message& event);

 private:
  void handle(const Input& input) override;

  [[nodiscard]] BagOfWords words_of(const KeyframeFeatures& features) const;
  [[nodiscard]] PlaceNovelty novelty_of(const OdometryPose& keyframe,
                                        const CandidateSearch& search) const;
  void publish(const KeyframeId& query, const CandidateSearch& search) const;

  const PlaceRecognitionConfig config_;
  const RobotId self_;
  const std::shared_ptr<const Vocabulary> vocabulary_;
  const PlaceRecognitionTopics topics_;
  PlaceDatabase own_;
  KnownPlaces known_;
  std::optional<UncertainPose> chain_;  // odometry of the newest own keyframe
  std::vector<KeyframeId> own_ids_;     // ids of the keyframes in own_, in the same order
  std::map<RobotId, std::set<KeyframeIndex>> searched_;  // keyframes of peers
};

}  // namespace km
