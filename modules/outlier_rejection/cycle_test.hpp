#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "modules/core/covariance.hpp"
#include "modules/core/pose_graph.hpp"
#include "modules/outlier_rejection/pair_cycle.hpp"
#include "modules/outlier_rejection/pcm_config.hpp"

namespace km {

/// A chain of transforms that ends at its start.
struct Cycle {
  UncertainPose T;              ///< Product of the transforms: the identity without errors.
  std::int64_t transforms = 0;  ///< Number of odometry steps and closures.
};

/// Tests closures between two robots, or inside one, for pairwise consistency: the cycle
///     T_ai_bi * T_bi_bk * T_bk_ak * T_ak_ai
/// along closure i, the odometry of b, closure k reversed and the odometry of a must be the
/// identity up to noise (Mangelson et al., "Pairwise Consistent Measurement Set Maximization for
/// Robust Multi-Robot Map Merging", ICRA 2018). The Mahalanobis form composes the covariances of
/// both closures and of both stretches of odometry along the cycle, as LAMP does (Ebadi et al.,
/// ICRA 2020, Sec. II-E). The four are assumed to be independent. Inside one robot they are not if
/// the stretches overlap.
class CycleTest {
 public:
  /// Throws ConfigError if `config` is out of bounds.
  explicit CycleTest(const PcmConfig& config);

  /// The closure with a.id < b.id and scaled covariances. Precondition: its two ends differ.
  [[nodiscard]] OrientedClosure orient(const Closure& closure) const;

  /// True if the cycle through both closures is consistent. Symmetric in i and k. Precondition:
  /// both are between the same robots.
  [[nodiscard]] bool consistent(const PreparedClosure& i, const PreparedClosure& k) const;

  /// Indices of the `others` that are consistent with `closure`, ascending.
  [[nodiscard]] std::vector<std::size_t> consistent_with(
      const PreparedClosure& closure, std::span<const PreparedClosure> others) const;

  /// True if the closure agrees with the odometry between its ends. Precondition: both ends are of
  /// one robot.
  [[nodiscard]] bool agrees_with_odometry(const OrientedClosure& closure) const;

 private:
  [[nodiscard]] bool within_bounds(double translation_m, double rotation_rad,
                                   std::int64_t transforms) const;

  PcmConfig config_;
  double max_distance_squared_;
};

/// The cycle through two closures between the same robots, from a_i to a_i, composed transform by
/// transform. PairCycle computes the same test faster.
[[nodiscard]] Cycle cycle_through(const OrientedClosure& i, const OrientedClosure& k);

/// The cycle of one closure inside a robot and the odometry between its ends.
[[nodiscard]] Cycle cycle_along_odometry(const OrientedClosure& closure);

/// Squared Mahalanobis distance of the identity from T.
[[nodiscard]] double distance_squared(const UncertainPose& T);

}  // namespace km
