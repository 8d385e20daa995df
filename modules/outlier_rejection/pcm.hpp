#pragma once

#include <cstddef>
#include <set>
#include <vector>

#include "modules/core/pose_graph.hpp"
#include "modules/outlier_rejection/cycle_test.hpp"
#include "modules/outlier_rejection/max_clique.hpp"
#include "modules/outlier_rejection/pcm_config.hpp"

namespace km {

/// Result for a closure given to Pcm.
enum class PcmVerdict {
  kRepeated,         ///< Its pair of keyframes is known; the first measurement is tested.
  kAgainstOdometry,  ///< Refused by the odometry gate.
  kFull,             ///< Pcm::kMaxClosures are stored already.
  kAdded,            ///< Stored; the consistent set is as before.
  kGrew,             ///< Stored; the consistent set is larger than before.
};

/// True if the closure can be weighed: poses finite with rotations orthonormal to 1e-6,
/// covariances that are covariances, two distinct ends.
[[nodiscard]] bool is_usable(const Closure& closure);

/// Throws std::invalid_argument unless the closure is_usable() and between robots `a` <= `b`.
void check_usable(const Closure& closure, RobotId a, RobotId b);

/// Incremental pairwise consistency maximisation (PCM) of the closures of one robot pair.
///
/// Keeps the largest set of closures that agree pairwise: the maximum clique of the graph whose
/// vertices are closures and whose edges are pairs consistent by CycleTest (Mangelson et al., ICRA
/// 2018). The set is updated after every closure (MaxClique). A pair of keyframes identifies a
/// closure and counts once, in either order and however often it was measured; the first
/// measurement is tested. Deterministic in the order of add(); the older of equally large sets is
/// kept. Not thread-safe. Copyable.
class Pcm {
 public:
  /// Bounds the memory for a flood of closures, here and elsewhere: about 60 MB of a robot's memory
  /// in all, including DDS (test/endure floods).
  static constexpr std::size_t kMaxClosures = 8000;

  /// For the closures between robots `a` and `b`; equal: those inside one robot.
  /// Throws ConfigError if `config` is out of bounds.
  Pcm(RobotId a, RobotId b, const PcmConfig& config);

  /// Adds one closure: one cycle test per stored closure, then the clique search.
  /// Throws std::invalid_argument if it is not between the two robots or not is_usable(); state is
  /// unchanged then.
  [[nodiscard]] PcmVerdict add(const Closure& closure);

  /// The consistent closures, ascending. Empty while they are fewer than PcmConfig::min_inliers.
  [[nodiscard]] std::vector<ClosureId> inliers() const;

  /// Closures stored, those of the consistent set included.
  [[nodiscard]] std::size_t size() const { return closures_.size(); }

  /// The largest set found and its proof, whatever PcmConfig::min_inliers.
  [[nodiscard]] const MaxClique& clique() const { return clique_; }

 private:
  RobotId a_, b_;
  PcmConfig config_;
  CycleTest test_;
  std::vector<PreparedClosure> closures_;
  std::set<ClosureId> known_;  // the refused ones too
  MaxClique clique_;
};

}  // namespace km
