#include <catch2/catch.hpp>
#include <limits>

#include "apps/experiments/spread.hpp"

namespace km {
namespace {

TEST_CASE("A spread is median, lowest and highest of what is finite", "[experiments]") {
  const Spread spread = spread_of({3.0, 1.0, std::numeric_limits<double>::quiet_NaN(), 2.0, 10.0});
  CHECK(spread.count == 4);
  CHECK(spread.median == 2.5);
  CHECK(spread.lowest == 1.0);
  CHECK(spread.highest == 10.0);
  CHECK(spread_of({}).count == 0);
}

TEST_CASE("A range is shown where there are several values", "[experiments]") {
  const ReportCell several = spread_cell(spread_of({1.0, 2.0, 4.0}), 1);
  CHECK(several.text == "2.0");
  CHECK(several.paper == "1.0 to 4.0");
  const ReportCell one = spread_cell(spread_of({1.0}), 2);
  CHECK(one.text == "1.00");
  CHECK(one.paper.empty());
  CHECK(spread_cell({}, 2).text == "-");
}

}  // namespace
}  // namespace km
