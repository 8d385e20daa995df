#include <catch2/catch.hpp>

#include "runtime/dds/robot_status.hpp"

namespace km {
namespace {

constexpr int kTicksInAnHour = 7200;

int statuses_in_an_hour(std::size_t others) {
  StatusPace pace;
  int sent = 0;
  for (int tick = 0; tick < kTicksInAnHour; ++tick) sent += pace.is_due(0, others) ? 1 : 0;
  return sent;
}

}  // namespace

TEST_CASE("statuses that a robot receives in an hour do not grow with a large team",
          "[dds][status]") {
  CHECK(statuses_in_an_hour(0) == Approx(kTicksInAnHour / 2).epsilon(0.01));
  CHECK(statuses_in_an_hour(10) == Approx(kTicksInAnHour / 2).epsilon(0.01));
  CHECK(statuses_in_an_hour(11) == Approx(kTicksInAnHour / 3).epsilon(0.01));
  // Beside the statuses of the first ten seconds.
  CHECK(statuses_in_an_hour(99) * 99 <= 1.05 * statuses_in_an_hour(10) * 10);
}

TEST_CASE("a change that other robots wait for is sent at once", "[dds][status]") {
  StatusPace pace;
  for (int tick = 0; tick <= 20; ++tick) (void)pace.is_due(0, 99);
  CHECK(pace.is_due(1, 99));
  CHECK_FALSE(pace.is_due(1, 99));
  CHECK(pace.is_due(2, 99));
  int ticks = 1;
  while (!pace.is_due(2, 99)) ++ticks;
  CHECK(ticks == 20);
}

}  // namespace km
