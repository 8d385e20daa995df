#include <catch2/catch.hpp>

#include "modules/pose_graph/status_schedule.hpp"

namespace km {
namespace {

using Due = StatusSchedule::Due;

TEST_CASE("A status that has not changed is not sent", "[status_schedule]") {
  StatusSchedule schedule;
  TeamStatus status;
  status.keyframes = 5;
  CHECK(schedule.due(status, 0.0) == Due::kStatus);
  CHECK_FALSE(schedule.may_be_due(0.4));
  CHECK(schedule.due(status, 0.9) == Due::kNo);
  CHECK(schedule.due(status, 1.0) == Due::kProgress);
  CHECK(schedule.due(status, 1.9) == Due::kNo);
}

TEST_CASE("A changed status is sent twice per period, one with a grown graph once",
          "[status_schedule]") {
  StatusSchedule schedule;
  TeamStatus status;
  status.keyframes = 5;
  REQUIRE(schedule.due(status, 0.0) == Due::kStatus);
  status.keyframes = 6;
  status.revision = 6;
  CHECK(schedule.due(status, 0.5) == Due::kNo);
  CHECK(schedule.due(status, 1.0) == Due::kStatus);
  status.keyframes = 7;
  status.frame_version = 1;
  CHECK(schedule.due(status, 1.5) == Due::kStatus);
  CHECK(schedule.due(status, 2.0) == Due::kNo);
  CHECK(schedule.due(status, 2.5) == Due::kProgress);
  status.offers.emplace_back();
  CHECK(schedule.due(status, 3.0) == Due::kStatus);
}

}  // namespace
}  // namespace km
