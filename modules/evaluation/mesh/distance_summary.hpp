#pragma once

#include <cstddef>
#include <vector>

namespace km {

/// Of distances from one surface to another.
struct DistanceSummary {
  std::size_t count = 0;
  double mean_m = 0.0;  ///< These and the shares are NaN for a count of 0.
  double median_m = 0.0;
  double p95_m = 0.0;
  double within_5cm = 0.0;  ///< Share, 0 to 1.
  double within_10cm = 0.0;
};

/// O(n).
[[nodiscard]] DistanceSummary summary_of(std::vector<float> distances_m);

}  // namespace km
