#include "modules/loop_closure/request_policy.hpp"

#include <algorithm>
#include <array>
#include <cstddef>

namespace km {
namespace {

using Pairs = std::set<std::pair<KeyframeIndex, KeyframeIndex>>;

// Two robots that have this number of keyframes with closures have mostly joined their maps.
constexpr int kJoined = 3;

// Robots that are not joined need closures more than they need to save bytes.
constexpr double kShareBeforeJoining = 0.2;

// Bound of what a misbehaving peer can make this robot store, 5 MB.
constexpr std::size_t kMaxRequests = 100'000;

KeyframeIndex gap(KeyframeIndex a, KeyframeIndex b) {
  return a > b ? a - b : b - a;
}

bool any_near(const Pairs& pairs, KeyframeIndex peers, KeyframeIndex own, KeyframeIndex reach) {
  auto pair = pairs.lower_bound({peers - std::min(peers, reach), 0});
  for (; pair != pairs.end() && pair->first <= peers + reach; ++pair)
    if (gap(pair->second, own) <= reach) return true;
  return false;
}

}  // namespace

RequestPolicy::RequestPolicy(const LoopClosureConfig& config) : config_(config) {}

bool RequestPolicy::Peer::is_near_closure(KeyframeIndex peers, KeyframeIndex own,
                                          int max_separation) const {
  const int reach = std::min(max_separation, successes);
  return reach > 0 && any_near(closures, peers, own, static_cast<KeyframeIndex>(reach));
}

RequestPolicy::Decision RequestPolicy::decide(const LoopCandidate& candidate) {
  Peer& peer = peers_[candidate.query.robot];
  const KeyframeIndex query = candidate.query.index;
  const KeyframeIndex own = candidate.match.index;
  if (peer.is_near_closure(query, own, config_.max_closure_separation))
    return Decision::kNearClosure;
  const int beside = std::min(config_.max_request_separation, peer.successes);
  if (any_near(peer.requests, query, own, static_cast<KeyframeIndex>(beside)))
    return Decision::kNearRequest;

  const double probability = peer.odds.probability(candidate);
  const double enough =
      (peer.successes < kJoined ? kShareBeforeJoining : 1.0) * config_.min_closure_probability;
  if (!(probability >= enough)) {
    // A query counts once, with its most probable candidate.
    if (peer.last_query != query) peer.last_share = 0.0;
    peer.last_query = query;
    const double share = std::max(peer.last_share, probability / enough);
    peer.credit += share - peer.last_share;
    peer.last_share = share;
    if (peer.credit < 1.0) return Decision::kImprobable;
    peer.credit -= 1.0;
  }
  peer.requests.emplace(query, own);
  peer.requested.emplace(query, candidate);
  return Decision::kRequest;
}

bool RequestPolicy::is_near_closure(const ClosureId& pair) const {
  const auto peer = peers_.find(pair.to.robot);
  return peer != peers_.end() && peer->second.is_near_closure(pair.to.index, pair.from.index,
                                                              config_.max_closure_separation);
}

void RequestPolicy::withdraw(const KeyframeId& keyframe) {
  peers_[keyframe.robot].requested.erase(keyframe.index);
}

void RequestPolicy::add_closure(const ClosureId& closure) {
  Peer& peer = peers_[closure.to.robot];
  const auto next = peer.closures.lower_bound({closure.to.index, 0});
  if (next == peer.closures.end() || next->first != closure.to.index)
    if (++peer.successes == kJoined) peer.credit = std::min(peer.credit, 1.0);
  peer.closures.emplace(closure.to.index, closure.from.index);
}

void RequestPolicy::add_peer_request(RobotId peer, KeyframeIndex peers, KeyframeIndex own) {
  auto& requests = peers_[peer].requests;
  if (requests.size() < kMaxRequests) requests.emplace(peers, own);
}

void RequestPolicy::add_result(const KeyframeId& keyframe, bool verified) {
  Peer& peer = peers_[keyframe.robot];
  const auto candidate = peer.requested.find(keyframe.index);
  if (candidate == peer.requested.end()) return;
  peer.odds.add(candidate->second, verified);
  peer.requested.erase(candidate);
}

const char* to_string(RequestPolicy::Decision decision) {
  // In the order of the enumerators.
  constexpr std::array kWords = {"requested", "not requested: near a verified closure",
                                 "not requested: near a requested candidate",
                                 "not requested: similar candidates have mostly failed"};
  return kWords[static_cast<std::size_t>(decision)];
}

}  // namespace km
