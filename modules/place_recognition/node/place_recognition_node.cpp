#include "modules/place_recognition/node/place_recognition_node.hpp"

#include <algorithm>
#include <span>
#include <string>
#include <utility>

#include "modules/core/data/median_depth.hpp"
#include "runtime/log.hpp"

namespace km {
namespace {

// A peer's history arrives in a burst; the queue holds an hour of keyframes at 4 Hz.
constexpr std::size_t kQueueCapacity = 16384;

// Standard deviation of an odometry step, per axis, above which its length is unknown.
constexpr double kLostWay_m = 0.5;

// Number of candidates while a further closure to a known place is due. Two closures are needed,
// because the noise of closures follows from pairs of them. More tie the keyframe to a place that
// earlier closures tie already, and each takes memory in every module.
constexpr std::size_t kDueCandidates = 2;

void keep_due(PlaceNovelty novelty, std::vector<PlaceCandidate>& candidates) {
  const std::size_t due = novelty == PlaceNovelty::kKnown ? kDueCandidates : 0;
  if (candidates.size() > due) candidates.resize(due);
}

bool breaks_odometry(const UncertainPose& before, const UncertainPose& now) {
  const Matrix6 step = between_on_chain(before, now).Sigma;
  return !(step.bottomRightCorner<3, 3>().trace() <= 3.0 * kLostWay_m * kLostWay_m);
}

}  // namespace

PlaceRecognitionNode::PlaceRecognitionNode(const PlaceRecognitionConfig& config, RobotId self,
                                           std::shared_ptr<const Vocabulary> vocabulary,
                                           const PlaceRecognitionTopics& topics)
    : WorkerNode({.name = "place_recognition", .queue = kQueueCapacity}),
      config_(checked(config)),
      self_(self),
      vocabulary_(std::move(vocabulary)),
      topics_(topics),
      own_(config_, vocabulary_->size()) {
  follow(topics.keyframes, topics.peer_bows, topics.closures, topics.peer_events);
}

void PlaceRecognitionNode::handle(const Input& input) {
  if (const auto* event = std::get_if<Topic<PeerEvent>::Message>(&input)) return step(*event);
  if (const auto* bow = std::get_if<Topic<KeyframeBow>::Message>(&input)) return step(**bow);
  if (const auto* closure = std::get_if<Topic<Closure>::Message>(&input)) return step(**closure);
  step(*std::get<Topic<Keyframe>::Message>(input));
}

void PlaceRecognitionNode::step(const Closure& closure) {
  if (closure.from.id.robot == self_ && closure.to.id.robot == self_) known_.add_closure(closure);
}

// Publishes the event itself, because messages of the robot wait until all copies of the event are
// released.
void PlaceRecognitionNode::step(const Topic<PeerEvent>::Message& event) {
  if (event->kind != PeerEventKind::kRestarted) return;
  searched_.erase(event->identity.robot);
  topics_.restarts.publish(event);
}

void PlaceRecognitionNode::step(const Keyframe& keyframe) {
  const KeyframeId id = keyframe.odometry.id;
  BagOfWords words = words_of(keyframe.features);
  BowVector vector = vocabulary_->weigh(words);
  const UncertainPose chain{keyframe.odometry.T_odom_kf, keyframe.odometry.covariance};
  if (const auto before = std::exchange(chain_, chain); before && breaks_odometry(*before, chain))
    own_.mark_odometry_break();
  CandidateSearch search = own_.search_own(vector, keyframe.stamp);
  const PlaceNovelty novelty = novelty_of(keyframe.odometry, search);
  if (novelty != PlaceNovelty::kNew) keep_due(novelty, search.candidates);
  KeyframeBow bow{.id = id, .stamp = keyframe.stamp, .vocabulary = vocabulary_->id(), .words = {}};
  if (novelty == PlaceNovelty::kNew && own_.is_view(vector)) {
    bow.words = std::move(words);
    bow.normalizer = search.normalizer;
    // Added before it is published, so that no pair is missed: see the class comment.
    own_.add(std::move(vector), keyframe.stamp);
    own_ids_.push_back(id);
    known_.add_view(keyframe.odometry, median_depth_m(keyframe.features).value_or(0.0));
  } else {
    own_.pass(std::move(vector), keyframe.stamp);
  }
  topics_.own_bows.publish(std::move(bow));
  publish(id, search);
}

void PlaceRecognitionNode::step(const KeyframeBow& peer_bow) {
  const KeyframeId id = peer_bow.id;
  if (id.robot == self_) return;
  if (peer_bow.vocabulary != vocabulary_->id()) {
    log::limited(log::Level::kWarn, name(), "vocabulary of " + std::to_string(id.robot))
        << "robot " << id.robot << " uses another vocabulary ("
        << fingerprint_text(peer_bow.vocabulary) << ", here " << fingerprint_text(vocabulary_->id())
        << "): its keyframes cannot be compared";
    return topics_.queries.publish(PlaceQuery{id, PlaceQueryStatus::kOtherVocabulary});
  }
  if (!vocabulary_->knows(peer_bow.words)) {
    log::limited(log::Level::kWarn, name(), "words of " + std::to_string(id.robot))
        << "keyframe " << to_string(id) << " has words beyond the vocabulary: not used";
    return topics_.queries.publish(PlaceQuery{id, PlaceQueryStatus::kUnknownWords});
  }
  if (!searched_[id.robot].insert(id.index).second)
    return topics_.queries.publish(PlaceQuery{id, PlaceQueryStatus::kRepeated});
  if (peer_bow.words.empty()) return publish(id, {});
  publish(id, own_.search(vocabulary_->weigh(peer_bow.words), peer_bow.normalizer));
}

BagOfWords PlaceRecognitionNode::words_of(const KeyframeFeatures& features) const {
  const auto most = static_cast<std::size_t>(config_.word_keypoints);
  const std::span all(features.descriptors);  // the strongest first
  return vocabulary_->count(all.first(std::min(most, all.size())));
}

PlaceNovelty PlaceRecognitionNode::novelty_of(const OdometryPose& keyframe,
                                              const CandidateSearch& search) const {
  std::vector<KeyframeIndex> similar;
  for (const PlaceCandidate& found : search.candidates)
    similar.push_back(own_ids_[found.index].index);
  return known_.novelty_of(keyframe, similar);
}

void PlaceRecognitionNode::publish(const KeyframeId& query, const CandidateSearch& search) const {
  for (const PlaceCandidate& found : search.candidates)
    topics_.candidates.publish(LoopCandidate{.query = query,
                                             .match = own_ids_[found.index],
                                             .similarity = found.similarity,
                                             .support = found.support});
  topics_.queries.publish(PlaceQuery{query, PlaceQueryStatus::kSearched});
}

}  // namespace km
