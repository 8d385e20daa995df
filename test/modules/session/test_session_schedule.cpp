#include "modules/session/session_schedule.hpp"

#include "test/support/test.hpp"

namespace km {
namespace {

using Due = StatusSchedule::Due;

// Seconds after the last session until the next one, while odometry changes the graph all the time.
double wait_s(SessionSchedule& schedule, std::uint64_t closures, bool all_joined = true) {
  for (double now_s = 0.0;; now_s += 0.5) {
    schedule.update(true, closures, all_joined, now_s);
    if (!schedule.is_worthwhile(0.0, now_s)) continue;
    schedule.opened();
    return now_s;
  }
}

TEST_CASE("A status that has not changed is not sent") {
  StatusSchedule schedule;
  TeamStatus status;
  status.keyframes = 5;
  CHECK(schedule.due(status, 0.0) == Due::kStatus);
  CHECK_FALSE(schedule.may_be_due(0.4));
  CHECK(schedule.due(status, 0.9) == Due::kNo);
  CHECK(schedule.due(status, 1.0) == Due::kProgress);
  CHECK(schedule.due(status, 1.9) == Due::kNo);
}

TEST_CASE("A changed status is sent twice per period, one with a grown graph once") {
  StatusSchedule schedule;
  TeamStatus status;
  status.keyframes = 5;
  REQUIRE(schedule.due(status, 0.0) == Due::kStatus);
  status.keyframes = 6;
  status.revision = 6;
  CHECK(schedule.due(status, 0.5) == Due::kNo);
  CHECK(schedule.due(status, 1.0) == Due::kStatus);
  status.keyframes = 7;
  status.upright = true;
  CHECK(schedule.due(status, 1.5) == Due::kStatus);
  CHECK(schedule.due(status, 2.0) == Due::kNo);
  CHECK(schedule.due(status, 2.5) == Due::kProgress);
  status.offers.emplace_back();
  CHECK(schedule.due(status, 3.0) == Due::kStatus);
}

}  // namespace

TEST_CASE("Sessions become rarer while robots find closures inside themselves only") {
  PoseGraphConfig config;
  config.session_wait_s = 60.0;
  config.session_growth = 1.0;
  SessionSchedule schedule(config);
  CHECK(wait_s(schedule, 10) == 0.0);
  CHECK(wait_s(schedule, 10) == 240.0);
  CHECK(wait_s(schedule, 10) == 240.0);
  CHECK(wait_s(schedule, 20) == 0.0);  // twice as many
  CHECK(wait_s(schedule, 21) == 60.0);
  CHECK(wait_s(schedule, 21) == 240.0);
  schedule.update(true, 21, true, 10.0);
  CHECK_FALSE(schedule.is_worthwhile(0.0, 11.9));
  CHECK(schedule.is_worthwhile(0.0, 12.0));  // the graph rests
}

TEST_CASE("Sessions come four times as soon while the place of a robot is not certain") {
  PoseGraphConfig config;
  config.session_wait_s = 60.0;
  config.session_growth = 2.0;
  SessionSchedule schedule(config);
  (void)wait_s(schedule, 10, false);
  CHECK(wait_s(schedule, 14, false) == 15.0);
  CHECK(wait_s(schedule, 21, false) == 0.0);  // by half of the closures before
  CHECK(wait_s(schedule, 21, false) == 60.0);
  CHECK(wait_s(schedule, 40, true) == 60.0);
  CHECK(wait_s(schedule, 120, true) == 0.0);
}

}  // namespace km
