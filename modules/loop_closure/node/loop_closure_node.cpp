#include "modules/loop_closure/node/loop_closure_node.hpp"

#include <algorithm>
#include <cstddef>
#include <utility>

#include "modules/loop_closure/keyframe_features.hpp"
#include "modules/loop_closure/keyframe_reply.hpp"
#include "modules/loop_closure/matching.hpp"
#include "runtime/clock.hpp"
#include "runtime/log.hpp"

namespace km {
namespace {

// Robots that meet again after a while produce candidates in bursts.
constexpr std::size_t kQueueCapacity = 16384;
constexpr double kTick_s = 0.1;

constexpr double kRequestTimeout_s = 2.0;   // after which an unanswered request is repeated
constexpr int kMaxOutstandingRequests = 8;  // to one peer; further ones wait

}  // namespace

LoopClosureNode::LoopClosureNode(const LoopClosureConfig& config, RobotId self,
                                 std::shared_ptr<const Vocabulary> vocabulary,
                                 const LoopClosureTopics& topics, ReadKeyframe read_keyframe)
    : WorkerNode({.name = "loop_closure", .queue = kQueueCapacity, .tick_s = kTick_s}),
      config_(config),
      self_(self),
      vocabulary_(std::move(vocabulary)),
      topics_(topics),
      verifier_(config),
      read_keyframe_(std::move(read_keyframe)),
      peers_(static_cast<std::size_t>(config.cached_keyframes)),
      requests_(kRequestTimeout_s, kMaxOutstandingRequests),
      policy_(config),
      reply_keypoints_(static_cast<std::size_t>(config.reply_keypoints)),
      full_keyframes_(static_cast<KeyframeIndex>(config.full_keyframes)) {
  follow(topics.keyframes, topics.candidates, topics.measured_closures, topics.peer_requests,
         topics.peer_replies, topics.peer_words, topics.peer_closures, topics.restarts,
         topics.restored);
  topics_.peer_events.subscribe([this](const auto& event) {
    if (event->kind != PeerEventKind::kRestarted) post(event);
  });
  if (vocabulary_) follow(topics.peer_bows);
}

void LoopClosureNode::step(const std::shared_ptr<const Keyframe>& own_keyframe) {
  own_[own_keyframe->odometry.id] = own_keyframe;
  evict_before(own_keyframe->odometry.id.index);
  arrived(own_keyframe);
}

// Removes a keyframe that is no longer among the newest from memory, if it can be read from the
// disk. Otherwise a part of its keypoints stays in memory.
void LoopClosureNode::evict_before(KeyframeIndex newest) {
  if (newest < full_keyframes_) return;
  const auto old = own_.find({self_, newest - full_keyframes_});
  if (old == own_.end()) return;
  if (read_keyframe_ && read_keyframe_(old->first.index) != nullptr) return old->second.reset();
  auto thinned = std::make_shared<Keyframe>(*old->second);
  thinned->features = reduced(thinned->features, 2 * reply_keypoints_);
  old->second = std::move(thinned);
}

void LoopClosureNode::step(const std::shared_ptr<const LoopCandidate>& candidate) {
  accept({{candidate->match, candidate->query}, candidate->similarity, candidate->support});
}

void LoopClosureNode::step(const std::shared_ptr<const RelativePose>& measured_closure) {
  accept({.id = {measured_closure->from, measured_closure->to}, .measured = *measured_closure});
}

void LoopClosureNode::step(const std::shared_ptr<const KeyframeRequest>& request) {
  if (request->requester == self_ || request->keyframe.robot != self_) {
    log::limited(log::Level::kWarn, name(), "misdirected " + std::to_string(request->requester))
        << "robot " << request->requester << " asks here for keyframe "
        << to_string(request->keyframe);
    return;
  }
  const KeyframePtr asked = own(request->keyframe);
  if (asked && request->network != asked->features.network)
    log::limited(log::Level::kWarn, name(), "network of " + std::to_string(request->requester))
        << "robot " << request->requester
        << " describes keypoints by another network, or by none: keyframes are matched by ORB; "
           "set the same keyframe_features.network on all robots";
  if (asked) policy_.add_peer_request(request->requester, request->own, request->keyframe.index);
  std::optional<WordsOfRequester> words;
  if (const auto* theirs = words_.find({request->requester, request->own}))
    words.emplace(WordsOfRequester{*vocabulary_, *theirs});
  if (request->part == KeyframePart::kWordPoints && asked && words)
    return topics_.own_words.publish(Addressed<KeyframeWords>{
        request->requester, std::make_shared<const KeyframeWords>(KeyframeWords{
                                request->number, request->keyframe,
                                common_word_points(asked->features, words->vocabulary, words->words,
                                                   most_word_points(reply_keypoints_))})});
  KeyframeReply reply{.number = request->number, .found = false, .keyframe = {}};
  reply.keyframe.odometry.id = request->keyframe;
  if (asked) reply = reply_to(*request, *asked, words, reply_keypoints_);
  topics_.own_replies.publish(Addressed<KeyframeReply>{
      request->requester, std::make_shared<const KeyframeReply>(std::move(reply))});
}

void LoopClosureNode::step(const std::shared_ptr<const KeyframeReply>& reply) {
  const KeyframeId& id = reply->keyframe.odometry.id;
  if (!reply->found) return requests_.absent(id, now_s_);
  // Ignores the reply to a repeated request, or one without a request.
  if (!requests_.arrived(id)) return;
  const auto before = promising_.find(id);
  if (auto complete = keyframe_of(*reply, before == promising_.end() ? nullptr : &before->second)) {
    // A copy is stored, because a referenced message counts as queued.
    const auto keyframe = std::make_shared<const Keyframe>(*std::move(complete));
    peers_.put(keyframe);
    arrived(keyframe);
  } else {
    promising_[id] = {};
    requests_.want(id);
  }
  send_due_requests();
}

void LoopClosureNode::step(const std::shared_ptr<const KeyframeWords>& words) {
  const KeyframeId& id = words->keyframe;
  // Ignores the reply to a repeated request, or one without a request.
  if (promising_.contains(id) || !vocabulary_ || !requests_.arrived(id)) return;
  if (withdraw_near_closures(id)) return send_due_requests();
  const std::vector<Work>& works = waiting_.at(id);
  if (std::ranges::any_of(works, [&](const Work& work) { return fits(work, words->words); })) {
    promising_.emplace(id, words->words);
    requests_.want(id);
  } else {
    for (const Work& work : works)
      report(work, ClosureStage::kReceived, "common words do not agree on a pose");
    waiting_.erase(id);
    policy_.add_result(id, false);
  }
  send_due_requests();
}

void LoopClosureNode::step(const std::shared_ptr<const Closure>& peer_closure) {
  const KeyframeId &from = peer_closure->from.id, &to = peer_closure->to.id;
  if (to.robot == self_ && from.robot != self_) policy_.add_closure({to, from});
}

void LoopClosureNode::step(const std::shared_ptr<const PeerEvent>& event) {
  const RobotId peer = event->identity.robot;
  if (event->kind == PeerEventKind::kRestarted) {
    forget(peer);
    return topics_.own_restarts.publish(*event);
  }
  if (event->kind != PeerEventKind::kReturned && event->kind != PeerEventKind::kJoined &&
      event->kind != PeerEventKind::kResumed)
    return;
  requests_.returned(peer);
  send_due_requests();
}

void LoopClosureNode::forget(RobotId peer) {
  peers_.forget(peer);
  words_.forget(peer);
  requests_.forget(peer);
  policy_.forget(peer);
  std::erase_if(promising_, [&](const auto& entry) { return entry.first.robot == peer; });
  std::erase_if(known_, [&](const ClosureId& id) { return touches(id, peer); });
  for (auto& [keyframe, works] : waiting_)
    std::erase_if(works, [&](const Work& work) { return touches(work.id, peer); });
  std::erase_if(waiting_, [](const auto& entry) { return entry.second.empty(); });
}

void LoopClosureNode::step(const std::shared_ptr<const KeyframeBow>& bow) {
  if (bow->vocabulary != vocabulary_->id()) return;
  std::vector<std::uint32_t> words;
  words.reserve(bow->words.size());
  for (const WordCount& entry : bow->words) words.push_back(entry.word);
  words_.put(bow->id, std::move(words));
}

void LoopClosureNode::step(const std::shared_ptr<const ClosureOutcome>& restored) {
  known_.insert(restored->id);
  if (restored->stage >= ClosureStage::kVerified && restored->id.to.robot != self_)
    policy_.add_closure(restored->id);
}

void LoopClosureNode::step(const LoopClosureTick& tick) {
  now_s_ = tick.now_s;
  send_due_requests();
}

void LoopClosureNode::accept(const Work& work) {
  const auto& [from, to] = work.id;
  if (from == to || from.robot != self_) {
    log::limited(log::Level::kWarn, name(), "foreign closure")
        << "no closure from a keyframe of this robot: " << to_string(from) << " - "
        << to_string(to);
    return;
  }
  // Place recognition may report two own keyframes in either order.
  if (!work.measured && known_.contains({to, from})) return;
  if (!known_.insert(work.id).second) return;
  report(work, ClosureStage::kCandidate);
  advance(work);
  send_due_requests();
}

LoopClosureNode::KeyframePtr LoopClosureNode::find(const KeyframeId& id) {
  return id.robot == self_ ? own(id) : peers_.get(id);
}

LoopClosureNode::KeyframePtr LoopClosureNode::own(const KeyframeId& id) const {
  const auto found = own_.find(id);
  if (found == own_.end() || found->second) return found == own_.end() ? nullptr : found->second;
  KeyframePtr keyframe = read_keyframe_(id.index);
  if (!keyframe)
    log::limited(log::Level::kWarn, name(), "not read")
        << "keyframe " << to_string(id) << " cannot be read from the disk any more: not compared";
  return keyframe;
}

// Completes the work if both keyframes are available; otherwise waits for a keyframe or requests
// it. True if the work led to a closure.
bool LoopClosureNode::advance(const Work& work) {
  const KeyframePtr from = find(work.id.from);
  const KeyframePtr to = find(work.id.to);
  if (from && to) return complete(work, *from, *to);
  // The own keyframe first: without it, the peer's keyframe would only fill the cache.
  const KeyframeId& missing = from ? work.id.to : work.id.from;
  if (missing.robot != self_) {
    request_keyframe(missing, work);
  } else if (own_.contains(missing)) {
    report(work, ClosureStage::kCandidate, "cannot be read from the disk any more");
  } else {
    waiting_[missing].push_back(work);
  }
  return false;
}

void LoopClosureNode::request_keyframe(const KeyframeId& missing, const Work& work) {
  const bool under_way = waiting_.contains(missing);
  if (!under_way && !work.measured) {
    const auto decision = policy_.decide({work.id.to, work.id.from, work.similarity, work.support});
    if (decision != RequestPolicy::Decision::kRequest)
      return report(work, ClosureStage::kCandidate, to_string(decision));
  }
  waiting_[missing].push_back(work);
  requests_.want(missing);
}

// Removes the candidates that wait for a keyframe of a peer and are near a closure that was
// verified meanwhile. True if none is left.
bool LoopClosureNode::withdraw_near_closures(const KeyframeId& missing) {
  std::vector<Work>& works = waiting_.at(missing);
  std::erase_if(works, [&](const Work& work) {
    if (work.measured || !policy_.is_near_closure(work.id)) return false;
    report(work, work.requested ? ClosureStage::kRequested : ClosureStage::kCandidate,
           to_string(RequestPolicy::Decision::kNearClosure));
    return true;
  });
  if (!works.empty()) return false;
  waiting_.erase(missing);
  promising_.erase(missing);
  policy_.withdraw(missing);
  return true;
}

void LoopClosureNode::arrived(const KeyframePtr& keyframe) {
  const auto found = waiting_.find(keyframe->odometry.id);
  if (found == waiting_.end()) return;
  const std::vector<Work> works = std::move(found->second);
  waiting_.erase(found);
  promising_.erase(keyframe->odometry.id);
  bool verified = false;
  for (const Work& work : works) verified |= advance(work);
  if (keyframe->odometry.id.robot != self_) policy_.add_result(keyframe->odometry.id, verified);
}

bool LoopClosureNode::fits(const Work& work, const WordPoints& theirs) const {
  if (work.measured) return true;
  const KeyframePtr keyframe = own(work.id.from);
  return keyframe && may_show_one_place(keyframe->features, *vocabulary_, theirs, config_);
}

KeyframePart LoopClosureNode::part_to_request(const KeyframeId& keyframe) const {
  const std::vector<Work>& works = waiting_.at(keyframe);
  const bool is_measured =
      std::ranges::any_of(works, [](const Work& work) { return work.measured.has_value(); });
  if (const auto found = promising_.find(keyframe); found != promising_.end())
    return found->second.points.empty() ? KeyframePart::kFeatures : KeyframePart::kDescriptors;
  return vocabulary_ && config_.min_word_points > 0 && !is_measured ? KeyframePart::kWordPoints
                                                                    : KeyframePart::kFeatures;
}

bool LoopClosureNode::complete(const Work& work, const Keyframe& from, const Keyframe& to) {
  Closure closure{.from = from.odometry,
                  .to = to.odometry,
                  .T_from_to = SE3::Identity(),
                  .covariance = Matrix6::Identity(),
                  .inliers = 0,
                  .similarity = work.similarity};
  Verification numbers;
  if (work.measured) {
    closure.T_from_to = work.measured->T_from_to;
    closure.covariance = work.measured->covariance;
  } else {
    // A robot sees many places like each other, and learned descriptors distinguish these less than
    // ORB does. Between robots, the words of ORB have agreed before.
    const bool is_inside = to.odometry.id.robot == self_;
    numbers = is_inside
                  ? verifier_.verify(without_network(from.features), without_network(to.features))
                  : verifier_.verify(from.features, to.features);
    if (is_inside && !(numbers.rotation_sigma_rad <= kMaxOwnRotationSigma_rad))
      numbers.status = VerificationStatus::kUncertainPose;
    if (numbers.status != VerificationStatus::kAccepted) {
      report(work, ClosureStage::kReceived, to_string(numbers.status), numbers);
      return false;
    }
    if (to.odometry.id.robot != self_) policy_.add_closure(work.id);
    closure.T_from_to = numbers.T_from_to;
    closure.covariance = numbers.covariance;
    closure.inliers = numbers.inliers;
  }
  log::debug(name()) << "verified " << to_string(work.id.from) << ' ' << to_string(work.id.to);
  report(work, ClosureStage::kVerified, {}, numbers);
  topics_.own_closures.publish(std::move(closure));
  return true;
}

void LoopClosureNode::report(const Work& work, ClosureStage stage, std::string reason,
                             const Verification& numbers) const {
  topics_.outcomes.publish(ClosureOutcome{.id = work.id,
                                          .similarity = work.similarity,
                                          .stage = stage,
                                          .reason = std::move(reason),
                                          .matches = numbers.matches,
                                          .inliers = numbers.inliers});
}

void LoopClosureNode::send_due_requests() {
  for (const KeyframeId& keyframe : requests_.due(now_s_)) {
    if (withdraw_near_closures(keyframe)) {
      (void)requests_.arrived(keyframe);
      continue;
    }
    std::vector<Work>& works = waiting_.at(keyframe);
    const KeyframePtr compared = own(works.front().id.from);
    auto request = std::make_shared<const KeyframeRequest>(
        KeyframeRequest{.requester = self_,
                        .number = next_request_++,
                        .keyframe = keyframe,
                        .own = works.front().id.from.index,
                        .part = part_to_request(keyframe),
                        .network = compared ? compared->features.network : std::uint16_t{0}});
    topics_.own_requests.publish(Addressed<KeyframeRequest>{keyframe.robot, std::move(request)});
    for (Work& work : works)
      if (!std::exchange(work.requested, true)) report(work, ClosureStage::kRequested);
  }
}

}  // namespace km
