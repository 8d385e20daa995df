#pragma once

#include <cstddef>
#include <set>
#include <vector>

#include "modules/core/data/pose_graph.hpp"
#include "modules/outlier_rejection/cycle_test.hpp"
#include "modules/outlier_rejection/max_clique.hpp"
#include "modules/outlier_rejection/pcm_config.hpp"

namespace km {

/// Result for a closure given to Pcm.
enum class PcmAddResult {
  kRepeated,  ///< Ignored: another measurement of this pair of keyframes came before.
  kFull,      ///< Refused: Pcm::kMaxClosures are known.
  kAdded,     ///< Stored; the consistent set is as large as before.
  kGrew,      ///< Stored; the consistent set is larger than before.
};

/// True if the closure has two distinct ends, finite poses with rotations orthonormal to 1e-6, and
/// valid covariances.
[[nodiscard]] bool is_usable(const Closure& closure);

/// Throws std::invalid_argument unless the closure is_usable() and between robots `a` <= `b`.
void check_usable(const Closure& closure, RobotId a, RobotId b);

/// Incremental pairwise consistency maximisation (PCM) of the closures of one robot pair.
///
/// Keeps the largest set of closures that agree pairwise: the maximum clique of the graph whose
/// vertices are closures and whose edges are pairs consistent by CycleTest (Mangelson et al., ICRA
/// 2018). The set is updated after every closure (MaxClique). A pair of keyframes in either order
/// identifies a closure, and only its first measurement counts. Deterministic in the order of
/// add(); the older of equally large sets is kept. Not thread-safe. Copyable.
class Pcm {
 public:
  /// Bounds the memory in a flood of closures: about 60 MB of a robot's memory in all modules and
  /// DDS (test/endure floods).
  static constexpr std::size_t kMaxClosures = 8000;

  /// For the closures between robots `a` and `b`, or inside one robot (a == b). Throws ConfigError
  /// if `config` is out of bounds.
  Pcm(RobotId a, RobotId b, const PcmConfig& config);

  /// Adds one closure: one cycle test per stored closure, then the clique search.
  /// Throws std::invalid_argument if the closure is not between the two robots or not is_usable();
  /// the state is then unchanged.
  [[nodiscard]] PcmAddResult add(const Closure& closure);

  /// The consistent closures, ascending. Empty while they are fewer than PcmConfig::min_inliers.
  [[nodiscard]] std::vector<ClosureId> inliers() const;

  /// Number of stored closures.
  [[nodiscard]] std::size_t size() const { return closures_.size(); }

  /// The largest set found, regardless of PcmConfig::min_inliers, with its bound.
  [[nodiscard]] const MaxClique& clique() const { return clique_; }

 private:
  RobotId a_, b_;
  PcmConfig config_;
  CycleTest test_;
  std::vector<PreparedClosure> closures_;
  std::set<ClosureId> known_;  // stored closures
  MaxClique clique_;
};

}  // namespace km
