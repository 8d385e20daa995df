#include "modules/evaluation/statistics.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "modules/core/quantile.hpp"

namespace km {

Statistics statistics_of(std::vector<double> values) {
  Statistics result;
  if (values.empty()) return result;
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
  result.max = std::ranges::max(values);
  result.median = quantile(std::move(values), 0.5);
  return result;
}

}  // namespace km
