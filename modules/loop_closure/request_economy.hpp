#pragma once

#include <array>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "modules/core/pose_graph.hpp"
#include "modules/loop_closure/loop_closure_config.hpp"

namespace km {

/// Whether a candidate is worth the bytes of asking a peer for its keyframe, which are nearly all
/// that loop closure sends.
///
/// Two robots that share a street or a room produce a candidate with every keyframe. The first
/// closures join their maps; one more beside them adds little. So a candidate is passed over near a
/// verified closure of the same two robots, near meaning that both its keyframes are no more
/// keyframes away than max_link_separation, or, while there are few, than the number of this peer's
/// keyframes that have led to a closure: the first ones may be dense. It is also passed over next
/// to one that has been asked for already; before the first closure all are asked for.
///
/// In a world that repeats itself most candidates are wrong. Right ones come in company: the views
/// around the match resemble the query, too. Candidates are told apart by peer and by how many of
/// their query support each other, and of a kind that has failed n + 4 times, only every n-th is
/// asked for (n times failure_patience): what never leads to anything costs ever less.
///
/// Deterministic, no randomness. Not thread-safe.
class RequestEconomy {
 public:
  enum class Verdict {
    kAsk,
    kLinked,  ///< Near a verified closure.
    kTried,   ///< Near a keyframe that was asked for.
    kVain,    ///< Its like have mostly failed.
  };

  explicit RequestEconomy(const LoopClosureConfig& config);

  /// What to do about a candidate whose query is a peer's keyframe that is not at hand. After kAsk
  /// it counts as asked for.
  [[nodiscard]] Verdict judge(const LoopCandidate& candidate);

  /// A closure between own keyframe `from` and a peer's `to` was verified.
  void link(const ClosureId& closure);

  /// The peer's keyframes are others now.
  void forget(RobotId peer) { peers_.erase(peer); }

  /// A keyframe that was asked for has come, and has led to closures or to none.
  void conclude(const KeyframeId& keyframe, bool verified);

 private:
  /// Candidates of one peer with about equal support.
  struct Kind {
    int failures = 0;
    int passed_over = 0;  ///< Queries since one was asked for.
  };
  struct Peer {
    std::set<std::pair<KeyframeIndex, KeyframeIndex>> links;  ///< (the peer's, own).
    std::set<std::pair<KeyframeIndex, KeyframeIndex>> tried;
    int successes = 0;
    std::array<Kind, 6> kinds;                     ///< By support, 5 and more alike.
    std::map<KeyframeIndex, std::size_t> kind_of;  ///< Of keyframes under way.
    std::optional<KeyframeIndex> in_vain;          ///< The last one passed over as such.
  };

  LoopClosureConfig config_;
  std::map<RobotId, Peer> peers_;
};

[[nodiscard]] const char* to_string(RequestEconomy::Verdict verdict);

}  // namespace km
