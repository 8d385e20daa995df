#include <catch2/catch.hpp>
#include <sstream>

#include "apps/experiments/step_display.hpp"

namespace km {
namespace {

using Catch::Contains;

TEST_CASE("The display says which step runs and how long all will take", "[experiments]") {
  std::ostringstream out;
  StepDisplay display(out, false, 80);
  display.start(3, 17, "team, City", 100.0, 600.0, 0.0);
  CHECK(display.text("robot0: 12 %", 40.0) ==
        "[3/17] team, City: 40 s, about 11 min left | robot0: 12 %");
  CHECK_THAT(display.text("", 130.0), Contains("2 min 10 s, about 11 min left"));
  display.update("early", 1.0);
  display.update("too soon", 5.0);
  display.update("shown", StepDisplay::kPlainInterval_s);
  display.finish("done", 124.0);
  CHECK_THAT(out.str(), !Contains("early") && !Contains("too soon") && Contains("shown") &&
                            Contains("[3/17] team, City: done in 2 min 4 s"));
}

TEST_CASE("A terminal's line is redrawn and never wider than it", "[experiments]") {
  std::ostringstream out;
  StepDisplay display(out, true, 40);
  display.start(1, 2, "team, City", 100.0, 0.0, 0.0);
  display.update(std::string(200, 'x'), 3.0);
  CHECK(out.str().starts_with("\r\x1b[K[1/2] team, City: 3.0 s"));
  CHECK(out.str().size() == 4 + 39);
}

TEST_CASE("Durations are rough", "[experiments]") {
  CHECK(rough_duration(0.0) == "less than a minute");
  CHECK(rough_duration(61.0) == "about 2 min");
  CHECK(rough_duration(9000.0) == "about 2.5 h");
}

}  // namespace
}  // namespace km
