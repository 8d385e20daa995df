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

/// A chain of transforms that returns to where it began.
struct Cycle {
  UncertainPose T;              ///< Its product: the identity if nothing had an error.
  std::int64_t transforms = 0;  ///< Odometry steps and closures in it.
};

/// Tests closures between two robots, or inside one, for pairwise consistency: the cycle
///     T_ai_bi * T_bi_bk * T_bk_ak * T_ak_ai
/// along closure i, the odometry of b, closure k reversed and the odometry of a must be the
/// identity up to noise (Mangelson et al., "Pairwise Consistent Measurement Set Maximization for
/// Robust Multi-Robot Map Merging", ICRA 2018). The Mahalanobis form composes the covariances of
/// both closures and of both stretches of odometry along the cycle, as LAMP does (Ebadi et al.,
/// ICRA 2020, Sec. II-E). The four are taken as independent, which inside one robot they are not
/// where the stretches overlap.
class CycleTest {
 public:
  /// Throws ConfigError if `config` is out of bounds.
  explicit CycleTest(const PcmConfig& config);

  /// The closure as the functions below take it. Precondition: its two ends differ.
  [[nodiscard]] OrientedClosure orient(const Closure& closure) const;

  /// Symmetric: it does not depend on which closure is named first. Precondition: both are between
  /// the same robots.
  [[nodiscard]] bool consistent(const PreparedClosure& i, const PreparedClosure& k) const;

  /// Numbers of the `others` that are consistent with `closure`, ascending.
  [[nodiscard]] std::vector<std::size_t> consistent_with(
      const PreparedClosure& closure, std::span<const PreparedClosure> others) const;

  /// True if the closure, inside one robot, agrees with the odometry between its ends.
  [[nodiscard]] bool agrees_with_odometry(const OrientedClosure& closure) const;

 private:
  [[nodiscard]] bool within_bounds(double translation_m, double rotation_rad,
                                   std::int64_t transforms) const;

  PcmConfig config_;
  double max_distance_squared_;
};

/// The cycle through two closures between the same robots, from ai and back to it, composed link by
/// link: the definition of what PairCycle computes.
[[nodiscard]] Cycle cycle_through(const OrientedClosure& i, const OrientedClosure& k);

/// The cycle of one closure inside a robot and the odometry between its ends.
[[nodiscard]] Cycle cycle_along_odometry(const OrientedClosure& closure);

/// Squared Mahalanobis distance of the identity from T.
[[nodiscard]] double distance_squared(const UncertainPose& T);

}  // namespace km
