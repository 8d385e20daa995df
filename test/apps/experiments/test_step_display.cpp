#include <catch2/catch.hpp>
#include <sstream>

#include "apps/experiments/step_display.hpp"
#include "apps/experiments/step_times.hpp"

namespace km {
namespace {

using Catch::Contains;

TEST_CASE("The display says which step runs and how long all will take", "[experiments]") {
  std::ostringstream out;
  StepDisplay display(out, false, 80);
  display.start(3, 17, "team, City", 100.0, 600.0, 0.0);
  CHECK(display.text("robot0: 12 %", 40.0) ==
        "[3/17] team, City: 40 s, about 11 min left | robot0: 12 %");
  CHECK(display.text("", 130.0) ==
        "[3/17] team, City: 2 min 10 s, longer than expected, then about 10 min");
  display.update("early", 1.0);
  display.update("too soon", 5.0);
  display.update("shown", StepDisplay::kPlainInterval_s);
  display.finish("done", 124.0);
  CHECK_THAT(out.str(), !Contains("early") && !Contains("too soon") && Contains("shown") &&
                            Contains("[3/17] team, City: done in 2 min 4 s"));
}

TEST_CASE("The last step promises nothing once it takes longer than expected", "[experiments]") {
  std::ostringstream out;
  StepDisplay display(out, false, 80);
  display.start(3, 3, "closures", 20.0, 0.0, 0.0);
  CHECK(display.text("", 19.0) == "[3/3] closures: 19 s, less than a minute left");
  CHECK(display.text("", 300.0) == "[3/3] closures: 5 min 0 s, longer than expected");
}

TEST_CASE("Steps are expected to take as much longer as their program has so far",
          "[experiments]") {
  StepTimes times;
  for (const double thought_s : {20.0, 20.0, 0.0, 40.0}) times.add("pcm", thought_s);
  times.add("pgo", 5.0);
  CHECK(times.later_s(0) == 65.0);
  times.note(0, 60.0);
  CHECK(times.expected_s(1) == 60.0);
  CHECK(times.later_s(1) == 125.0);
  times.note(1, 20.0);
  CHECK(times.expected_s(3) == 80.0);
  CHECK(times.later_s(4) == 0.0);
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
