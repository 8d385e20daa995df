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

}  // namespace km
