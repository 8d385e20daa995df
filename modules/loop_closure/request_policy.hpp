#pragma once

#include <map>
#include <set>
#include <utility>

#include "modules/core/data/pose_graph.hpp"
#include "modules/loop_closure/closure_odds.hpp"
#include "modules/loop_closure/loop_closure_config.hpp"

namespace km {

/// Decides whether a candidate is worth the bytes of requesting a keyframe from a peer. These
/// requests cause nearly all traffic of loop closure.
///
/// Two robots that share a street or a room produce a candidate with every keyframe. The first
/// closures join their maps, and further closures near them add little. A candidate is therefore
/// skipped near a verified closure of the same two robots: both keyframes of the candidate are
/// within max_closure_separation keyframes of those of the closure. While fewer keyframes of this
/// peer have led to closures, their number replaces max_closure_separation, so that the first
/// closures may be dense. A candidate is also skipped near a requested candidate, with
/// max_request_separation in place of max_closure_separation. Before the first closure with a peer,
/// neither rule skips a candidate, except a pair that the peer itself compares.
/// Candidates wait for earlier requests, so is_near_closure() tests them again.
///
/// In an environment with similar places most candidates are wrong. A candidate is requested if
/// the probability p that it leads to a closure (ClosureOdds, one for each peer) is at least
/// min_closure_probability. Among queries with less probable candidates, a share of
/// p / min_closure_probability is requested. So the share falls where candidates fail, and the
/// robot still learns from them. Until three keyframes of a peer have led to closures, a fifth of
/// min_closure_probability suffices. Six further improbable queries are then requested, too,
/// because robots with few places in common need each of them.
///
/// Deterministic, no randomness. Not thread-safe.
class RequestPolicy {
 public:
  enum class Decision {
    kRequest,
    kNearClosure,  ///< Near a verified closure.
    kNearRequest,  ///< Near a requested candidate.
    kImprobable,   ///< Similar candidates have mostly failed.
  };

  explicit RequestPolicy(const LoopClosureConfig& config);

  /// Decides about a candidate whose query is a peer's keyframe that this robot does not have.
  /// After kRequest the candidate counts as requested.
  [[nodiscard]] Decision decide(const LoopCandidate& candidate);

  /// True if decide() would now skip the candidate `pair` near a verified closure. `pair` starts at
  /// an own keyframe.
  [[nodiscard]] bool is_near_closure(const ClosureId& pair) const;

  /// Notes that a keyframe is not requested after all.
  void withdraw(const KeyframeId& keyframe);

  /// Notes that a closure from an own keyframe to a keyframe of a peer was verified, by this robot
  /// or, with the ends exchanged, by the peer.
  void add_closure(const ClosureId& closure);

  /// Notes that `peer` requested an own keyframe for its own: it compares this pair, and the pairs
  /// beside it, so that this robot need not.
  void add_peer_request(RobotId peer, KeyframeIndex peers, KeyframeIndex own);

  /// Discards all about a peer, because its keyframe indices now mean other keyframes.
  void forget(RobotId peer) { peers_.erase(peer); }

  /// Notes that a requested keyframe has arrived and whether it has led to closures.
  void add_result(const KeyframeId& keyframe, bool verified);

 private:
  // Six requests of 1.1 kB are few beside a map that is never joined.
  static constexpr double kFirstRequests = 6.0;

  struct Peer {
    std::set<std::pair<KeyframeIndex, KeyframeIndex>> closures;  ///< Pairs (keyframe of the peer,
                                                                 ///< own keyframe).
    std::set<std::pair<KeyframeIndex, KeyframeIndex>>
        requests;       ///< Such pairs that were requested.
    int successes = 0;  ///< Number of different peer keyframes in `closures`.
    ClosureOdds odds;
    double credit = kFirstRequests;  ///< kFirstRequests and the sum of p / min_closure_probability
                                     ///< of the improbable queries, less the requests among them.
    KeyframeIndex last_query = 0;    ///< The query that `credit` counts last,
    double last_share = 0.0;         ///< and what it has added.
    std::map<KeyframeIndex, LoopCandidate> requested;  ///< By query; without a result so far.

    [[nodiscard]] bool is_near_closure(KeyframeIndex peers, KeyframeIndex own,
                                       int max_separation) const;
  };

  LoopClosureConfig config_;
  std::map<RobotId, Peer> peers_;
};

[[nodiscard]] const char* to_string(RequestPolicy::Decision decision);

}  // namespace km
