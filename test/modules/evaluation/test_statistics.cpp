#include "modules/evaluation/statistics.hpp"

#include <catch2/catch.hpp>
#include <cmath>

namespace km {

TEST_CASE("Statistics of known numbers", "[evaluation]") {
  const Statistics odd = statistics_of({3.0, 1.0, 2.0});
  CHECK(odd.count == 3);
  CHECK(odd.mean == Approx(2.0));
  CHECK(odd.median == 2.0);
  CHECK(odd.max == 3.0);
  CHECK(odd.rmse == Approx(std::sqrt(14.0 / 3.0)));
  CHECK(statistics_of({4.0, 1.0, 2.0, 3.0}).median == 2.5);
  CHECK(statistics_of({}).count == 0);
  CHECK(statistics_of({}).rmse == 0.0);
}

TEST_CASE("Quantiles lie linearly between the values", "[statistics]") {
  const std::vector<double> values = {40.0, 10.0, 30.0, 20.0, 50.0};
  CHECK(quantile(values, 0.0) == 10.0);
  CHECK(quantile(values, 0.5) == 30.0);
  CHECK(quantile(values, 0.625) == Approx(35.0));
  CHECK(quantile(values, 1.0) == 50.0);
  CHECK(quantile({7.0}, 0.3) == 7.0);
  CHECK(std::isnan(quantile({}, 0.5)));
}

}  // namespace km
