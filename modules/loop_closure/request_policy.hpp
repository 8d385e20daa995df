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
/// within max_closure_separation keyframes of those of the closure. While fewer keyframes of this
/// peer have led to closures, their number replaces max_closure_separation, so that the first
/// closures may be dense. A candidate is also skipped near a requested candidate, with
/// max_request_separation in place of max_closure_separation. Before the first closure with a peer,
/// neither rule skips a candidate, except a pair that the peer itself compares.
///
/// In an environment with similar places most candidates are wrong. Right candidates come in
/// groups, because the views around the match resemble the query too. Candidates are grouped by
/// peer and by their support. After n + 4 failures in a group, n times skips_per_failure queries
/// are skipped before the next request, so a group that never succeeds costs less and less.
///
/// Deterministic, no randomness. Not thread-safe.
class RequestPolicy {
 public:
  enum class Decision {
    kRequest,
    kNearClosure,  ///< Near a verified closure.
    kNearRequest,  ///< Near a requested candidate.
    kLowYield,     ///< Too many candidates of the group have failed.
  };

  explicit RequestPolicy(const LoopClosureConfig& config);

  /// Decides about a candidate whose query is a peer's keyframe that this robot does not have.
  /// After kRequest the candidate counts as requested.
  [[nodiscard]] Decision decide(const LoopCandidate& candidate);

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
  /// Candidates of one peer with about equal support.
  struct SupportGroup {
    int failures = 0;
    int skipped = 0;  ///< Queries since a candidate of this group was requested.
  };
  struct Peer {
    std::set<std::pair<KeyframeIndex, KeyframeIndex>> closures;  ///< Pairs (keyframe of the peer,
                                                                 ///< own keyframe).
    std::set<std::pair<KeyframeIndex, KeyframeIndex>>
        requests;                        ///< Such pairs that were requested.
    int successes = 0;                   ///< Number of different peer keyframes in `closures`.
    std::array<SupportGroup, 6> groups;  ///< Indexed by support; supports of 5 and more
                                         ///< share a group.
    std::map<KeyframeIndex, std::size_t> group_of;  ///< Index into `groups` of requested keyframes.
    std::optional<KeyframeIndex> last_skipped;      ///< Query of the last candidate with decision
                                                    ///< kLowYield.
  };

  LoopClosureConfig config_;
  std::map<RobotId, Peer> peers_;
};

[[nodiscard]] const char* to_string(RequestPolicy::Decision decision);

}  // namespace km
