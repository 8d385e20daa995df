#include "modules/loop_closure/node/loop_closure_node.hpp"

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <span>
#include <stdexcept>
#include <utility>
#include <vector>

#include "modules/core/keyframe.hpp"
#include "modules/loop_closure/keyframe_features.hpp"
#include "modules/place_recognition/vocabulary.hpp"
#include "runtime/clock.hpp"
#include "runtime/log.hpp"

namespace km {
namespace {

// Robots that meet again after a while produce candidates in bursts.
constexpr std::size_t kQueueCapacity = 16384;
constexpr std::chrono::milliseconds kTickPeriod(100);
constexpr std::size_t kLeastPart = 4;  // reply_keypoints over KeypointBudget::least

// Number of keypoints of one image to send.
struct KeypointBudget {
  std::size_t least = 0;  // lower bound, if there are enough keypoints
  std::size_t most = 0;
};

// The keypoints of `features` for a robot whose own image of the place has the words `theirs`,
// ascending. Keypoints with a known depth whose word is in `theirs` come first, up to budget.most.
// If there are fewer than budget.least, other keypoints follow, those with depth first. The shared
// words indicate corresponding points and cost no bytes, because bags of words are published anyway
// (Galvez-Lopez and Tardos, TRO 2012, use the same association to save comparisons). If few words
// are shared, the two images seldom show one place. On EuRoC V1_01, 400 keypoints with depth verify
// 229 pairs. With 200 keypoints, 183 of these pairs are verified if words decide, and 135
// otherwise.
KeyframeFeatures chosen_by_words(const KeyframeFeatures& features, const KeypointBudget& budget,
                                 const Vocabulary& vocabulary,
                                 std::span<const std::uint32_t> theirs) {
  if (features.keypoints.size() <= budget.least) return features;
  const std::vector<std::uint32_t> words = vocabulary.words(features.descriptors);
  std::vector<int> rank;
  for (std::size_t i = 0; i < words.size(); ++i) {
    const bool shared = std::binary_search(theirs.begin(), theirs.end(), words[i]);
    rank.push_back((features.keypoints[i].has_depth() ? 2 : 0) + (shared ? 1 : 0));
  }
  std::vector<std::size_t> order(words.size());
  std::iota(order.begin(), order.end(), 0U);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return rank[a] > rank[b]; });
  constexpr int kBest = 3;  // rank of a keypoint with depth and a shared word
  const auto best = static_cast<std::size_t>(std::count(rank.begin(), rank.end(), kBest));
  order.resize(std::min(order.size(), std::clamp(best, budget.least, budget.most)));
  KeyframeFeatures chosen = features;
  chosen.keypoints.clear();
  chosen.descriptors.clear();
  for (const std::size_t i : order) {
    chosen.keypoints.push_back(features.keypoints[i]);
    chosen.descriptors.push_back(features.descriptors[i]);
  }
  return chosen;
}

// `features` without the keypoints at `places`.
KeyframeFeatures without(const KeyframeFeatures& features, std::span<const std::size_t> places) {
  std::vector<bool> is_left(features.keypoints.size(), true);
  for (const std::size_t i : places) is_left[i] = false;
  KeyframeFeatures rest = features;
  rest.keypoints.clear();
  rest.descriptors.clear();
  for (std::size_t i = 0; i < is_left.size(); ++i) {
    if (!is_left[i]) continue;
    rest.keypoints.push_back(features.keypoints[i]);
    rest.descriptors.push_back(features.descriptors[i]);
  }
  return rest;
}

}  // namespace

LoopClosureNode::LoopClosureNode(const LoopClosureConfig& config, RobotId self,
                                 std::shared_ptr<const Vocabulary> vocabulary,
                                 const LoopClosureTopics& topics, ReadKeyframe read_keyframe)
    : config_(config),
      self_(self),
      vocabulary_(std::move(vocabulary)),
      topics_(topics),
      verifier_(config),
      read_keyframe_(std::move(read_keyframe)),
      peers_(static_cast<std::size_t>(config.cached_keyframes)),
      requests_(config.request_timeout_s, config.max_outstanding_requests),
      policy_(config),
      reply_keypoints_(static_cast<std::size_t>(config.reply_keypoints)),
      full_keyframes_(static_cast<KeyframeIndex>(config.full_keyframes)),
      worker_(
          kQueueCapacity, Overflow::kBlock,
          [this](const Input& input) {
            std::visit([this](const auto& message) { step(message); }, input);
          },
          "loop_closure"),
      periodic_(kTickPeriod, [this] { worker_.post(LoopClosureTick{steady_now_s()}); }) {
  const auto queue = [this](const auto& message) { worker_.post(message); };
  topics_.keyframes.subscribe(queue);
  topics_.candidates.subscribe(queue);
  topics_.measured_closures.subscribe(queue);
  topics_.peer_requests.subscribe(queue);
  topics_.peer_replies.subscribe(queue);
  topics_.peer_words.subscribe(queue);
  topics_.peer_closures.subscribe(queue);
  topics_.peer_events.subscribe([this](const auto& event) {
    if (event->kind != PeerEventKind::kRestarted) worker_.post(event);
  });
  topics_.restarts.subscribe(queue);
  topics_.restored.subscribe(queue);
  if (vocabulary_) topics_.peer_bows.subscribe(queue);
}

void LoopClosureNode::start() {
  worker_.start();
  periodic_.start();
}

void LoopClosureNode::stop() noexcept {
  periodic_.stop();
  worker_.stop();
}

std::exception_ptr LoopClosureNode::error() const {
  const std::exception_ptr failure = worker_.error();
  return failure ? failure : periodic_.error();
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
  thinned->features.keypoints.shrink_to_fit();
  thinned->features.descriptors.shrink_to_fit();
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
  if (asked) policy_.add_peer_request(request->requester, request->own, request->keyframe.index);
  const std::vector<std::uint32_t>* theirs = words_.find({request->requester, request->own});
  if (request->part == KeyframePart::kWordPoints && asked && theirs != nullptr)
    return topics_.own_words.publish(Addressed<KeyframeWords>{
        request->requester,
        std::make_shared<const KeyframeWords>(KeyframeWords{
            request->number, request->keyframe,
            common_word_points(asked->features, *vocabulary_, *theirs, reply_keypoints_)})});
  KeyframeReply reply{.number = request->number, .found = false, .keyframe = {}};
  reply.keyframe.odometry.id = request->keyframe;
  if (asked) reply = reply_to(*request, *asked, theirs);
  topics_.own_replies.publish(Addressed<KeyframeReply>{
      request->requester, std::make_shared<const KeyframeReply>(std::move(reply))});
}

// `theirs` are the words of the requester's keyframe, null if unknown.
KeyframeReply LoopClosureNode::reply_to(const KeyframeRequest& request, const Keyframe& asked,
                                        const std::vector<std::uint32_t>* theirs) const {
  const KeyframeFeatures& features = asked.features;
  KeyframeReply reply{.number = request.number, .found = true, .keyframe = {}};
  reply.keyframe.odometry = asked.odometry;
  reply.keyframe.stamp = asked.stamp;
  const KeypointBudget budget{reply_keypoints_ / kLeastPart, reply_keypoints_};
  if (theirs == nullptr) {
    reply.keyframe.features = reduced(features, budget.most);
  } else if (request.part != KeyframePart::kDescriptors) {
    reply.keyframe.features = chosen_by_words(features, budget, *vocabulary_, *theirs);
  } else {
    const std::vector<std::size_t> points =
        common_word_places(features, *vocabulary_, *theirs, budget.most);
    for (const std::size_t point : points) reply.descriptors.push_back(features.descriptors[point]);
    reply.keyframe.features =
        reduced(without(features, points), budget.least - std::min(budget.least, points.size()));
  }
  return reply;
}

void LoopClosureNode::step(const std::shared_ptr<const KeyframeReply>& reply) {
  const KeyframeId& id = reply->keyframe.odometry.id;
  if (!reply->found) return requests_.absent(id, now_s_);
  // Ignores the reply to a repeated request, or one without a request.
  if (!requests_.arrived(id)) return;
  if (const KeyframePtr keyframe = received(*reply)) {
    peers_.put(keyframe);
    arrived(keyframe);
  } else {
    promising_[id] = {};
    requests_.want(id);
  }
  send_due_requests();
}

// The keyframe of `reply` with the points that were received before; null if they are not those of
// the reply. A copy, because a referenced message counts as queued.
LoopClosureNode::KeyframePtr LoopClosureNode::received(const KeyframeReply& reply) const {
  auto keyframe = std::make_shared<Keyframe>(reply.keyframe);
  if (reply.descriptors.empty()) return keyframe;
  const auto before = promising_.find(keyframe->odometry.id);
  if (before == promising_.end() || before->second.points.size() != reply.descriptors.size())
    return nullptr;
  KeyframeFeatures& features = keyframe->features;
  features.focal_px = before->second.focal_px;
  features.baseline_m = before->second.baseline_m;
  for (const WordPoint& point : before->second.points) features.keypoints.push_back(point.keypoint);
  features.descriptors.insert(features.descriptors.end(), reply.descriptors.begin(),
                              reply.descriptors.end());
  return keyframe;
}

void LoopClosureNode::step(const std::shared_ptr<const KeyframeWords>& words) {
  const KeyframeId& id = words->keyframe;
  // Ignores the reply to a repeated request, or one without a request.
  if (promising_.contains(id) || !vocabulary_ || !requests_.arrived(id)) return;
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
    numbers = verifier_.verify(from.features, to.features);
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
    std::vector<Work>& works = waiting_.at(keyframe);
    auto request =
        std::make_shared<const KeyframeRequest>(KeyframeRequest{.requester = self_,
                                                                .number = next_request_++,
                                                                .keyframe = keyframe,
                                                                .own = works.front().id.from.index,
                                                                .part = part_to_request(keyframe)});
    topics_.own_requests.publish(Addressed<KeyframeRequest>{keyframe.robot, std::move(request)});
    for (Work& work : works)
      if (!std::exchange(work.requested, true)) report(work, ClosureStage::kRequested);
  }
}

}  // namespace km
