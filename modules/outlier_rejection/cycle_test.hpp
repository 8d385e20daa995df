#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "modules/core/pose_graph.hpp"
#include "modules/outlier_rejection/pair_cycle.hpp"
#include "modules/outlier_rejection/pcm_config.hpp"

namespace km {

/// Tests closures between two robots, or inside one, for pairwise consistency: the cycle
///     T_ai_bi * T_bi_bk * T_bk_ak * T_ak_ai
/// along closure i, the odometry of b, closure k reversed and the odometry of a must be the
/// identity up to noise (Mangelson et al., "Pairwise Consistent Measurement Set Maximization for
/// Robust Multi-Robot Map Merging", ICRA 2018). The test composes the covariances of
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

 private:
  PcmConfig config_;
  double max_distance_squared_;
};

}  // namespace km
