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
/// closures join their maps, and further ones near them add little. So a candidate is skipped near
/// a verified closure of the same two robots: both its keyframes are within max_link_separation
/// keyframes. While few keyframes of this peer have led to closures, their number replaces that
/// distance, so that the first closures may be dense. A candidate is also skipped near one that has
/// been requested already. Before the first closure all are requested.
///
/// In an environment with similar places most candidates are wrong. Right ones come in groups,
/// because the views around the match resemble the query, too. Candidates are grouped by peer and
/// by how many candidates of their query support each other. After n + 4 failures in a group, only
/// every n-th candidate (n times failure_patience) is requested, so a group that never succeeds
/// costs less and less.
///
/// Deterministic, no randomness. Not thread-safe.
class RequestEconomy {
 public:
  enum class Verdict {
    kAsk,
    kLinked,  ///< Near a verified closure.
    kTried,   ///< Near a keyframe that was asked for.
    kVain,    ///< Most candidates of its group have failed.
  };

  explicit RequestEconomy(const LoopClosureConfig& config);

  /// Decides about a candidate whose query is a peer's keyframe that is not available here. After
  /// kAsk the candidate counts as requested.
  [[nodiscard]] Verdict judge(const LoopCandidate& candidate);

  /// A closure between own keyframe `from` and a peer's `to` was verified.
  void link(const ClosureId& closure);

  /// The peer's keyframes are others now.
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
    std::set<std::pair<KeyframeIndex, KeyframeIndex>> tried;
    int successes = 0;
    std::array<Kind, 6> kinds;                     ///< Indexed by support; supports of 5 and more
                                                   ///< share a kind.
    std::map<KeyframeIndex, std::size_t> kind_of;  ///< Kinds of the requested keyframes.
    std::optional<KeyframeIndex> in_vain;          ///< The last candidate that was skipped as
                                                   ///< kVain.
  };

  LoopClosureConfig config_;
  std::map<RobotId, Peer> peers_;
};

[[nodiscard]] const char* to_string(RequestEconomy::Verdict verdict);

}  // namespace km
