#pragma once

#include <algorithm>
#include <cstddef>
#include <limits>
#include <vector>

namespace km {

/// The value below which a share `p` in [0, 1] of the sample lies, linear between sorted
/// neighbours; NaN for an empty sample. O(n).
template <typename T = double>
[[nodiscard]] double quantile(std::vector<T> values, double p) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  const double position = std::clamp(p, 0.0, 1.0) * static_cast<double>(values.size() - 1);
  const auto below = static_cast<std::ptrdiff_t>(position);
  const auto middle = values.begin() + below;
  std::nth_element(values.begin(), middle, values.end());
  const double share = position - static_cast<double>(below);
  const auto low = static_cast<double>(*middle);
  if (share == 0.0) return low;
  const auto high = static_cast<double>(*std::min_element(middle + 1, values.end()));
  return (1.0 - share) * low + share * high;
}

}  // namespace km
