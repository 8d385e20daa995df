#include "runtime/clock.hpp"
#include "runtime/periodic.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

TEST_CASE("Stamps are due in proportion to the rate, from the first one on") {
  const double rate = GENERATE(0.5, 1.0, 4.0);
  ReplayClock clock(rate);
  const auto start = ReplayClock::TimePoint{} + std::chrono::hours(1);
  const Stamp first = 1403636579763555584;
  CHECK(clock.due(first, start) == start);
  const auto due = clock.due(first + nanoseconds(10.0), start + std::chrono::seconds(3));
  REQUIRE(due.has_value());
  CHECK(std::chrono::duration<double>(*due - start).count() == Approx(10.0 / rate));
}

TEST_CASE("A pause makes everything due later by as much") {
  ReplayClock clock(2.0);
  const auto start = ReplayClock::TimePoint::clock::now();
  CHECK(clock.due(0, start) == start);
  clock.pause(1.5);
  const auto due = clock.due(nanoseconds(10.0), start);
  REQUIRE(due);
  CHECK(std::chrono::duration<double>(*due - start).count() == Approx(6.5));
  const auto since_epoch = std::chrono::duration<double>(due->time_since_epoch()).count();
  CHECK(clock.due_s(nanoseconds(10.0)) == Approx(since_epoch));
}

TEST_CASE("Playing as fast as possible never waits") {
  ReplayClock clock(std::numeric_limits<double>::infinity());
  CHECK(clock.wait_until(0));
  CHECK(clock.wait_until(nanoseconds(1e9)));
  CHECK_FALSE(clock.due_s(nanoseconds(1e9)));
}

TEST_CASE("Stopping a replay releases the source that waits") {
  ReplayClock clock(1.0);
  CHECK(clock.wait_until(0));
  auto waiting = std::async(std::launch::async, [&] { return clock.wait_until(nanoseconds(1e6)); });
  clock.stop();
  CHECK_FALSE(waiting.get());
  CHECK_FALSE(clock.wait_until(0));
}

TEST_CASE("A periodic ticks until it is stopped, however long its period") {
  std::promise<void> ticked;
  Periodic hourly(std::chrono::hours(1), [&] { ticked.set_value(); });
  hourly.start();
  ticked.get_future().get();
  hourly.stop();
  CHECK(hourly.error() == nullptr);

  std::atomic<int> ticks = 0;
  std::promise<void> enough;
  Periodic quick(std::chrono::microseconds(10), [&] {
    if (++ticks == 100) enough.set_value();
  });
  quick.start();
  enough.get_future().get();
  quick.stop();
  const int after = ticks;
  CHECK(after >= 100);
}

}  // namespace
}  // namespace km
