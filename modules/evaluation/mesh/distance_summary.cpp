#include "modules/evaluation/mesh/distance_summary.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace km {
namespace {

// Linear between neighbours in order of size.
double quantile_of(std::vector<float>& values, double p) {
  const double position = p * static_cast<double>(values.size() - 1);
  const auto below = static_cast<std::ptrdiff_t>(position);
  const auto middle = values.begin() + below;
  std::nth_element(values.begin(), middle, values.end());
  const auto low = static_cast<double>(*middle);
  const double share = position - static_cast<double>(below);
  if (share == 0.0) return low;
  const auto high = static_cast<double>(*std::min_element(middle + 1, values.end()));
  return low + share * (high - low);
}

double share_within(const std::vector<float>& values, float limit) {
  const auto count =
      std::count_if(values.begin(), values.end(), [&](float value) { return value <= limit; });
  return static_cast<double>(count) / static_cast<double>(values.size());
}

}  // namespace

DistanceSummary summary_of(std::vector<float> distances_m) {
  DistanceSummary summary;
  summary.count = distances_m.size();
  if (distances_m.empty()) {
    const double none = std::numeric_limits<double>::quiet_NaN();
    return {0, none, none, none, none, none};
  }
  double sum = 0.0;
  for (const float distance : distances_m) sum += static_cast<double>(distance);
  summary.mean_m = sum / static_cast<double>(distances_m.size());
  summary.within_5cm = share_within(distances_m, 0.05F);
  summary.within_10cm = share_within(distances_m, 0.10F);
  summary.median_m = quantile_of(distances_m, 0.5);
  summary.p95_m = quantile_of(distances_m, 0.95);
  return summary;
}

}  // namespace km
