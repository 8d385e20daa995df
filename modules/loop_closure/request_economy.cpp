#include "modules/loop_closure/request_economy.hpp"

#include <algorithm>

namespace km {
namespace {

using Pairs = std::set<std::pair<KeyframeIndex, KeyframeIndex>>;

// A few wrong candidates must not prevent the first closure of two robots.
constexpr int kForgivenFailures = 4;

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

RequestEconomy::RequestEconomy(const LoopClosureConfig& config) : config_(config) {}

RequestEconomy::Verdict RequestEconomy::judge(const LoopCandidate& candidate) {
  Peer& peer = peers_[candidate.query.robot];
  const KeyframeIndex query = candidate.query.index;
  const KeyframeIndex own = candidate.match.index;
  const int reach = std::min(config_.max_link_separation, peer.successes);
  if (reach > 0 && any_near(peer.links, query, own, static_cast<KeyframeIndex>(reach)))
    return Verdict::kLinked;
  const int beside = std::min(config_.attempt_separation, peer.successes);
  if (beside > 0 && any_near(peer.tried, query, own, static_cast<KeyframeIndex>(beside)))
    return Verdict::kTried;

  const auto kind_number =
      std::min<std::size_t>(static_cast<std::size_t>(candidate.support), peer.kinds.size() - 1);
  Kind& kind = peer.kinds[kind_number];
  if (peer.in_vain != query) ++kind.passed_over;  // once per query
  const int failures = std::max(0, kind.failures - kForgivenFailures);
  if (kind.passed_over <= config_.failure_patience * failures) {
    peer.in_vain = query;
    return Verdict::kVain;
  }
  kind.passed_over = 0;
  peer.tried.emplace(query, own);
  peer.kind_of[query] = kind_number;
  return Verdict::kAsk;
}

void RequestEconomy::link(const ClosureId& closure) {
  peers_[closure.to.robot].links.emplace(closure.to.index, closure.from.index);
}

void RequestEconomy::conclude(const KeyframeId& keyframe, bool verified) {
  Peer& peer = peers_[keyframe.robot];
  const auto kind = peer.kind_of.find(keyframe.index);
  if (kind == peer.kind_of.end()) return;
  if (verified) {
    ++peer.successes;
  } else {
    ++peer.kinds[kind->second].failures;
  }
  peer.kind_of.erase(kind);
}

const char* to_string(RequestEconomy::Verdict verdict) {
  switch (verdict) {
    case RequestEconomy::Verdict::kAsk:
      return "asked for";
    case RequestEconomy::Verdict::kLinked:
      return "not asked for: its place is linked already";
    case RequestEconomy::Verdict::kTried:
      return "not asked for: one beside it was";
    case RequestEconomy::Verdict::kVain:
      return "not asked for: its like have mostly failed";
  }
  return "";
}

}  // namespace km
