#include "modules/evaluation/statistics.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace km {

Statistics statistics_of(std::vector<double> values) {
  Statistics result;
  if (values.empty()) return result;
  std::sort(values.begin(), values.end());
  result.count = values.size();
  double sum = 0.0;
  double sum_of_squares = 0.0;
  for (const double value : values) {
    sum += value;
    sum_of_squares += value * value;
  }
  const auto n = static_cast<double>(values.size());
  result.mean = sum / n;
  result.rmse = std::sqrt(sum_of_squares / n);
  const std::size_t half = values.size() / 2;
  result.median = values.size() % 2 == 1 ? values[half] : 0.5 * (values[half - 1] + values[half]);
  result.max = values.back();
  return result;
}

double quantile(std::vector<double> values, double p) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  const double position = std::clamp(p, 0.0, 1.0) * static_cast<double>(values.size() - 1);
  const auto below = static_cast<std::ptrdiff_t>(position);
  const auto middle = values.begin() + below;
  std::nth_element(values.begin(), middle, values.end());
  const double share = position - static_cast<double>(below);
  if (share == 0.0) return *middle;
  return (1.0 - share) * *middle + share * *std::min_element(middle + 1, values.end());
}

}  // namespace km
