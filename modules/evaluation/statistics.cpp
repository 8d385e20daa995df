#include "modules/evaluation/statistics.hpp"

#include <algorithm>
#include <cmath>

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

}  // namespace km
