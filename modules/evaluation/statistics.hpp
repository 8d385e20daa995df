#pragma once

#include <cstddef>
#include <vector>

namespace km {

/// Summary of a sample of magnitudes. All zero for an empty one.
struct Statistics {
  std::size_t count = 0;
  double rmse = 0.0;
  double mean = 0.0;
  double median = 0.0;  ///< Mean of the middle two for an even count.
  double max = 0.0;
};

[[nodiscard]] Statistics statistics_of(std::vector<double> values);

/// The value below which a share `p` in [0, 1] of the sample lies, linear between neighbours in
/// order of size; NaN for an empty sample. O(n).
[[nodiscard]] double quantile(std::vector<double> values, double p);

}  // namespace km
