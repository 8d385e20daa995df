#pragma once

#include <cstdint>

#include "modules/outlier_rejection/prepared_closure.hpp"

namespace km {

/// The cycle through two closures between the same robots: from ai along closure i, the odometry of
/// b, closure k reversed and the odometry of a; seen from odom_a, where it begins and ends.
class PairCycle {
 public:
  /// Borrows both.
  PairCycle(const PreparedClosure& i, const PreparedClosure& k);

  /// True if the squared Mahalanobis distance of the identity from the cycle is at most the given.
  [[nodiscard]] bool within_distance(double max_distance_squared) const;

  [[nodiscard]] double translation_m() const;  ///< Length of the cycle's, as ai sees it.
  [[nodiscard]] double rotation_rad() const;
  [[nodiscard]] std::int64_t transforms() const;  ///< Odometry steps and closures.

 private:
  [[nodiscard]] BlockCovariance covariance() const;

  const PreparedClosure& i_;
  const PreparedClosure& k_;
  SE3 T_;
};

}  // namespace km
