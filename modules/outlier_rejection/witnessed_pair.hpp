#pragma once

#include <cstddef>
#include <set>
#include <vector>

#include "modules/outlier_rejection/local_contest.hpp"
#include "modules/outlier_rejection/pcm.hpp"

namespace km {

/// The closures of one robot pair, with a test whether independent closures confirm each other.
///
/// Places that look alike yield several false closures that agree with each other. Closures whose
/// ends on both robots lie within kNeighbourhood keyframes of each other therefore count as one
/// witness. The witnesses are a largest set of closures that agree pairwise (CycleTest) and do not
/// share a neighbourhood. Not thread-safe. Copyable.
class WitnessedPair {
 public:
  static constexpr KeyframeIndex kNeighbourhood = 3;  ///< [keyframes]

  /// For the closures between robots `a` and `b`, or inside one robot (a == b). Throws ConfigError
  /// if `config` is out of bounds.
  WitnessedPair(RobotId a, RobotId b, const PcmConfig& config);

  /// Adds one closure. closures() contains it after kAdded and kGrew; after kGrew there are more
  /// witnesses. Once there are PcmConfig::min_witnesses, no cycle is tested any more. At most
  /// Pcm::kMaxClosures are kept. Between two robots further ones are refused, because OwnGraph
  /// keeps no more of a peer. Inside a robot with these witnesses, closures that tie nearly the
  /// same keyframes as others are dropped instead. Throws std::invalid_argument if the closure is
  /// not between the two robots or not is_usable(); the state is then unchanged.
  [[nodiscard]] PcmAddResult add(const Closure& closure);

  /// The added closures without dropped ones and those that stronger ones beside them contradict
  /// (LocalContest), ascending. Without witnesses, those that do not state their inliers overrule
  /// the others: a constellation is known by many objects, a place that looks alike by one view.
  [[nodiscard]] std::vector<ClosureId> closures() const;
  /// Number of witnesses found, at most PcmConfig::min_witnesses.
  [[nodiscard]] std::size_t witnesses() const { return clique_.clique().size(); }
  /// True if there are PcmConfig::min_witnesses.
  [[nodiscard]] bool is_witnessed() const;
  /// True if the support() reaches PcmConfig::min_lone_support, or a closure does not state its
  /// inliers (0, as in recorded graphs). Without witnesses, a place with less may be one that only
  /// looks alike.
  [[nodiscard]] bool is_strong() const {
    return !unstated_.empty() || support() >= config_.min_lone_support;
  }
  /// Most inliers of a closure and of those beside it that agree, see LocalContest.
  [[nodiscard]] int support() const { return static_cast<int>(contest_.most_support()); }

 private:
  void test(const Closure& closure);
  void thin();
  [[nodiscard]] bool contradicts_unstated(const PreparedClosure& closure) const;

  RobotId a_, b_;
  PcmConfig config_;
  CycleTest test_;
  std::set<ClosureId> known_;  // added closures
  std::set<ClosureId> added_;
  std::set<ClosureId> unstated_;  // those in `tested_` that do not state their inliers
  LocalContest contest_;          // among added closures
  std::vector<PreparedClosure> tested_;
  MaxClique clique_;  // over `tested_`; closures that share a neighbourhood are not connected
};

}  // namespace km
