#pragma once

#include <array>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "modules/core/pose_graph.hpp"
#include "modules/loop_closure/loop_closure_config.hpp"

namespace km {

/// Decides whether a candidate is worth the bytes of requesting a keyframe from a peer. These
/// requests cause nearly all traffic of loop closure.
///
/// Two robots that share a street or a room produce a candidate with every keyframe. The first
/// closures join their maps, and further closures near them add little. A candidate is therefore
/// skipped near a verified closure of the same two robots: both keyframes of the candidate are
/// within max_link_separation keyframes of those of the closure. While fewer keyframes of this peer
/// have led to closures, their number replaces max_link_separation, so that the first closures may
/// be dense. A candidate is also skipped near a requested candidate, with attempt_separation in
/// place of max_link_separation. Before the first closure with a peer, neither rule skips a
/// candidate.
///
/// In an environment with similar places most candidates are wrong. Right candidates come in
/// groups, because the views around the match resemble the query too. Candidates are grouped by
/// peer and by their support. After n + 4 failures in a group, n times failure_patience queries are
/// skipped before the next request, so a group that never succeeds costs less and less.
///
/// Deterministic, no randomness. Not thread-safe.
class RequestEconomy {
 public:
  enum class Verdict {
    kAsk,
    kLinked,  ///< Near a verified closure.
    kTried,   ///< Near a requested candidate.
    kVain,    ///< Too many candidates of the group have failed.
  };

  explicit RequestEconomy(const LoopClosureConfig& config);

  /// Decides about a candidate whose query is a peer's keyframe that this robot does not have.
  /// After kAsk the candidate counts as requested.
  [[nodiscard]] Verdict judge(const LoopCandidate& candidate);

  /// Notes that a closure from an own keyframe to a keyframe of a peer was verified.
  void link(const ClosureId& closure);

  /// Discards all about a peer, because its keyframe indices now mean other keyframes.
  void forget(RobotId peer) { peers_.erase(peer); }

  /// Notes that a requested keyframe has arrived and whether it has led to closures.
  void conclude(const KeyframeId& keyframe, bool verified);

 private:
  /// Candidates of one peer with about equal support.
  struct Kind {
    int failures = 0;
    int passed_over = 0;  ///< Queries since a candidate of this kind was requested.
  };
  struct Peer {
    std::set<std::pair<KeyframeIndex, KeyframeIndex>> links;  ///< Pairs (keyframe of the peer, own
                                                              ///< keyframe).
    std::set<std::pair<KeyframeIndex, KeyframeIndex>> tried;  ///< Such pairs that were requested.
    int successes = 0;          ///< Number of keyframes of the peer that led to closures.
    std::array<Kind, 6> kinds;  ///< Indexed by support; supports of 5 and more
                                ///< share a kind.
    std::map<KeyframeIndex, std::size_t> kind_of;  ///< Index into `kinds` of requested keyframes.
    std::optional<KeyframeIndex> in_vain;          ///< Query of the last candidate with verdict
                                                   ///< kVain.
  };

  LoopClosureConfig config_;
  std::map<RobotId, Peer> peers_;
};

[[nodiscard]] const char* to_string(RequestEconomy::Verdict verdict);

}  // namespace km
