#include "runtime/metrics.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

// Half a bucket of 1 %, and rounding.
constexpr double kTolerance = 0.00505;

double nearest_rank(std::vector<double> values, double p) {
  std::ranges::sort(values);
  const double rank = std::max(1.0, std::ceil(p * static_cast<double>(values.size())));
  return values[static_cast<std::size_t>(rank) - 1];
}

TEST_CASE("Quantiles agree with sorting all values") {
  const auto seed = GENERATE(range(0U, 20U));
  const auto count = GENERATE(1, 2, 3, 10, 1000);
  CAPTURE(seed, count);
  std::mt19937 rng(seed);
  std::lognormal_distribution<double> duration(std::log(3e-3), 2.0);
  DurationHistogram histogram;
  std::vector<double> values;
  double sum = 0.0;
  for (int i = 0; i < count; ++i) {
    values.push_back(duration(rng));
    sum += values.back();
    histogram.add(values.back());
  }
  for (const double p : {0.01, 0.25, 0.5, 0.95, 0.99, 1.0}) {
    CAPTURE(p);
    CHECK(histogram.quantile_s(p) == Approx(nearest_rank(values, p)).epsilon(kTolerance));
  }
  CHECK(histogram.count() == values.size());
  CHECK(histogram.max_s() == *std::ranges::max_element(values));
  CHECK(histogram.total_s() == sum);
}

TEST_CASE("Durations off the scale are still counted") {
  DurationHistogram histogram;
  CHECK(histogram.quantile_s(0.5) == 0.0);
  histogram.add(0.0);
  CHECK(histogram.quantile_s(0.5) == 0.0);
  histogram.add(5000.0);
  CHECK(histogram.max_s() == 5000.0);
  CHECK(histogram.count() == 2);
}

}  // namespace
}  // namespace km
