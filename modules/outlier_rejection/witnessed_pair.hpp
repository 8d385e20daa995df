#pragma once

#include <cstddef>
#include <set>
#include <vector>

#include "modules/outlier_rejection/pcm.hpp"

namespace km {

/// The closures of one robot pair, and whether independent ones confirm each other.
///
/// Places that look alike yield several false closures that agree with each other. So closures
/// whose ends on both robots lie within kNeighbourhood keyframes of each other count as one
/// witness. Witnesses are the closures of a largest set that agree pairwise (CycleTest) and of
/// which no two share a neighbourhood. Not thread-safe. Copyable.
class WitnessedPair {
 public:
  /// In keyframes.
  static constexpr KeyframeIndex kNeighbourhood = 3;

  /// For the closures between robots `a` and `b`; equal: those inside one robot.
  /// Throws ConfigError if `config` is out of bounds.
  WitnessedPair(RobotId a, RobotId b, const PcmConfig& config);

  /// Adds one closure. kAdded: it is one of closures() now; kGrew: and there are more witnesses. At
  /// most Pcm::kMaxClosures are taken. Once there are PcmConfig::min_witnesses nothing is tested
  /// any more. Throws std::invalid_argument if the closure is not between the two robots or not
  /// is_usable(); state is unchanged then.
  [[nodiscard]] PcmVerdict add(const Closure& closure);

  /// All that were added, ascending.
  [[nodiscard]] std::vector<ClosureId> closures() const { return {added_.begin(), added_.end()}; }
  /// Number of independent closures that agree: a lower bound, at most PcmConfig::min_witnesses.
  [[nodiscard]] std::size_t witnesses() const { return clique_.clique().size(); }
  /// True if there are PcmConfig::min_witnesses.
  [[nodiscard]] bool is_witnessed() const;

 private:
  void test(const OrientedClosure& closure);

  RobotId a_, b_;
  PcmConfig config_;
  CycleTest test_;
  std::set<ClosureId> known_;  // the refused ones too
  std::set<ClosureId> added_;
  std::vector<PreparedClosure> tested_;
  MaxClique clique_;  // clique of `tested_`; closures that share a neighbourhood are not connected
};

/// True if both ends of `x` are within WitnessedPair::kNeighbourhood keyframes of those of `y`.
/// Precondition: both are between the same robots, each with the lower keyframe first.
[[nodiscard]] bool share_neighbourhood(const ClosureId& x, const ClosureId& y);

}  // namespace km
