#include "runtime/dds/fair_queue.hpp"
#include "runtime/dds/robot_status.hpp"
#include "runtime/dds/send_schedule.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

using Schedule = SendSchedule<std::string, int>;
using Entry = Schedule::Entry;
using enum SendPriority;

const std::vector<RobotId> kOne{7};

// A message of topic "t" with 100 bytes.
Entry entry(SendPriority priority, int message) {
  return {.topic = "t", .priority = priority, .bytes = 100, .message = message};
}

// Messages that the schedule sends at `now_s`.
std::vector<int> sent(Schedule& schedule, double now_s, std::vector<RobotId> readers = kOne) {
  std::vector<int> messages;
  while (const auto next = schedule.pop(now_s, [&](const auto&) { return std::optional(readers); }))
    messages.push_back(next->message);
  return messages;
}

TEST_CASE("Messages are sent by priority and in order within a priority") {
  const bool limited = GENERATE(false, true);
  Schedule schedule({.bytes_per_s = limited ? 1e9 : 0.0});
  int message = 0;
  for (int round = 0; round < 2; ++round)
    for (const SendPriority priority : {kMesh, kWords, kPoses, kVerification, kClosures, kPresence})
      schedule.push(entry(priority, message++), 1.0);
  CHECK(schedule.size() == 12);
  schedule.push({}, 1.0);  // takes no time to send
  std::vector<int> all;
  for (double now_s = 2.0; now_s < 3.0; now_s += 0.01)
    for (const int one : sent(schedule, now_s)) all.push_back(one);
  CHECK(all == std::vector<int>{5, 11, 4, 10, 3, 9, 2, 8, 1, 7, 0, 6, 0});
  CHECK(schedule.size() == 0);
}

TEST_CASE("The bytes sent equal the budget for messages of any size") {
  const std::uint64_t bytes = GENERATE(100U, 1000U, 30'000U);
  const std::size_t readers = GENERATE(1U, 3U);
  CAPTURE(bytes, readers);
  constexpr double kRate = 10'000.0, kSeconds = 100.0;
  Schedule schedule({.bytes_per_s = kRate});
  double sent_bytes = 0.0;
  for (int step = 0; step < 100 * static_cast<int>(kSeconds); ++step) {
    const double now_s = 0.01 * step;
    while (schedule.size() < 10) {
      Entry next = entry(kWords, 0);
      next.bytes = bytes;
      schedule.push(next, now_s);
    }
    sent_bytes += static_cast<double>(
        bytes * readers * sent(schedule, now_s, std::vector<RobotId>(readers, 7)).size());
  }
  const double budget = kRate * kSeconds;
  const double message = static_cast<double>(bytes * readers);
  CHECK(sent_bytes >= budget - 0.011 * kRate);  // it looks a hundred times a second
  CHECK(sent_bytes <= budget + message);
}

TEST_CASE("Statuses never wait, and are counted") {
  Schedule schedule({.bytes_per_s = 1000.0});
  for (int k = 0; k < 10; ++k) schedule.push(entry(kPresence, k), 0.0);
  schedule.push(entry(kClosures, 10), 0.0);
  CHECK(sent(schedule, 0.0).size() == 10);
  CHECK(sent(schedule, 0.99).empty());
  CHECK(sent(schedule, 1.01) == std::vector<int>{10});
}

TEST_CASE("Bags of words that have waited follow new ones") {
  Schedule schedule({.bytes_per_s = 1000.0});
  for (int k = 0; k < 60; ++k) schedule.push(entry(kWords, k), 0.0);
  CHECK(sent(schedule, 0.0) == std::vector<int>{0});
  schedule.push(entry(kWords, 100), 6.0);
  schedule.push(entry(kMesh, 200), 6.0);
  CHECK(sent(schedule, 6.0) == std::vector<int>{100, 1, 2});
  CHECK(schedule.held_back().at("t").delayed == TrafficCount{2, 200});
}

TEST_CASE("Only the newest of a waiting state is kept, at the position of the first") {
  Schedule schedule({.bytes_per_s = 1000.0});
  const auto state = [&](std::uint64_t key, int message, std::optional<RobotId> to = {}) {
    Entry next = entry(kPoses, message);
    next.newest_wins = true;
    next.key = key;
    next.to = to;
    schedule.push(next, 0.0);
  };
  state(9, 0);
  CHECK(sent(schedule, 0.0) == std::vector<int>{0});
  state(1, 11);
  state(2, 21);
  state(1, 12);
  state(1, 13, 7);  // for another
  CHECK(sent(schedule, 0.0).empty());
  state(1, 14);
  std::vector<int> all;
  for (const double now_s : {0.11, 0.21, 0.31, 0.41})
    for (const int one : sent(schedule, now_s)) all.push_back(one);
  CHECK(all == std::vector<int>{14, 21, 13});
  const HeldBack& held = schedule.held_back().at("t");
  CHECK(held.superseded == TrafficCount{2, 200});
  CHECK(held.delayed == TrafficCount{3, 300});
  CHECK(held.waiting == TrafficCount{});
  CHECK(held.dropped == TrafficCount{});
}

TEST_CASE("Requests that are too old to be answered are dropped") {
  Schedule schedule({.bytes_per_s = 100.0});
  for (int k = 0; k < 10; ++k) {
    Entry request = entry(kVerification, k);
    request.useful_s = 3.5;
    schedule.push(request, 0.0);
  }
  std::vector<int> all;
  for (double now_s = 0.0; now_s < 20.0; now_s += 0.3)
    for (const int one : sent(schedule, now_s)) all.push_back(one);
  CHECK(all == std::vector<int>{0, 1, 2, 3});
  CHECK(schedule.held_back().at("t").dropped == TrafficCount{6, 600});
}

TEST_CASE("A run's total is kept, and the most important has some of it left") {
  Schedule schedule({.bytes_per_run = 10'000.0});
  std::size_t went = 0;
  const auto offer = [&](SendPriority priority) {
    for (int k = 0; k < 200; ++k) schedule.push(entry(priority, k), 0.0);
    went += sent(schedule, 0.0).size();
    return went;
  };
  CHECK(offer(kMesh) == 60);
  CHECK(offer(kWords) == 80);
  CHECK(offer(kVerification) == 90);
  CHECK(offer(kPoses) == 95);
  CHECK(offer(kClosures) == 100);
  CHECK_FALSE(schedule.wait_s());  // nothing waits for what never comes
  CHECK(schedule.held_back().at("t").dropped == TrafficCount{900, 90'000});
  CHECK(offer(kPresence) == 300);
}

TEST_CASE("Messages without room and messages left at the end are dropped and counted") {
  Schedule schedule({.bytes_per_s = 1.0});
  constexpr std::size_t kMany = Schedule::kMaxMessages + 10;
  for (std::size_t k = 0; k < kMany; ++k) schedule.push(entry(kMesh, static_cast<int>(k)), 0.0);
  CHECK(schedule.size() == Schedule::kMaxMessages);
  CHECK(schedule.held_back().at("t").dropped.messages == 10);
  CHECK(sent(schedule, 0.0) == std::vector<int>{10});  // the oldest had to go
  schedule.drop_all();
  CHECK(schedule.held_back().at("t").dropped.messages == kMany - 1U);
  CHECK(schedule.held_back().at("t").waiting == TrafficCount{});

  Entry large = entry(kMesh, 1);
  large.bytes = Schedule::kMaxBytes;
  schedule.push(large, 0.0);
  schedule.push(large, 0.0);
  CHECK(schedule.size() == 1);
}

TEST_CASE("Bytes that DDS sends by itself are charged to the budget") {
  Schedule schedule({.bytes_per_s = 1000.0});
  schedule.settle(500, 0.0);
  schedule.push(entry(kClosures, 1), 0.0);
  CHECK(sent(schedule, 0.49).empty());
  CHECK(sent(schedule, 0.51) == std::vector<int>{1});
  schedule.settle(600, 0.51);  // that very message
  schedule.push(entry(kClosures, 2), 0.51);
  CHECK(sent(schedule, 0.62) == std::vector<int>{2});
}

TEST_CASE("Messages without a reader wait and delay no others") {
  Schedule schedule({.bytes_per_s = 1000.0});
  schedule.push(entry(kWords, 1), 0.0);
  schedule.push(entry(kMesh, 2), 0.0);
  const auto readers_of = [](const Entry& e) {
    return e.priority == kWords ? std::nullopt : std::optional(kOne);
  };
  CHECK(schedule.pop(0.0, readers_of)->message == 2);
  CHECK_FALSE(schedule.pop(0.0, readers_of));
  CHECK_FALSE(schedule.wait_s());
  CHECK(schedule.held_back().at("t").waiting == TrafficCount{1, 100});
}

TEST_CASE("Without a budget nothing is dropped, replaced or counted") {
  Schedule schedule({});
  constexpr std::size_t kMany = Schedule::kMaxMessages + 10;
  for (std::size_t k = 0; k < kMany; ++k) {
    Entry state = entry(kPoses, 1);
    state.newest_wins = true;
    state.useful_s = 1.0;
    schedule.push(state, 0.0);
  }
  CHECK(sent(schedule, 100.0).size() == kMany);
  CHECK(schedule.held_back().empty());
}

std::vector<int> drain(FairQueue<int>& queue, double now_s) {
  std::vector<int> served;
  while (const auto message = queue.pop(now_s)) served.push_back(*message);
  return served;
}

TEST_CASE("Peers are served in turn, each in order") {
  FairQueue<int> queue({});
  for (const int i : {1, 2, 3, 4}) CHECK(queue.push(7, 70 + i, 1, 0.0));
  for (const int i : {1, 2}) CHECK(queue.push(9, 90 + i, 1, 0.0));
  CHECK(queue.push(8, 81, 1, 0.0));
  CHECK(queue.size() == 7);
  CHECK(drain(queue, 0.0) == std::vector<int>{71, 81, 91, 72, 92, 73, 74});
  CHECK(queue.size() == 0);
  CHECK_FALSE(queue.wait_s(0.0));
}

TEST_CASE("A peer that has no room loses its own newest, or its oldest") {
  const bool newest_wins = GENERATE(false, true);
  QueueQuota quota{.newest_wins = newest_wins};
  SECTION("by number") {
    quota.messages = 3;
  }
  SECTION("by bytes") {
    quota.bytes = 35;
  }
  FairQueue<int> queue(quota);
  for (const int i : {1, 2, 3}) CHECK(queue.push(7, i, 10, 0.0));
  CHECK_FALSE(queue.push(7, 4, 10, 0.0));
  CHECK(queue.push(8, 8, 10, 0.0));
  CHECK(drain(queue, 0.0) ==
        (newest_wins ? std::vector<int>{2, 8, 3, 4} : std::vector<int>{1, 8, 2, 3}));
  CHECK(queue.push(7, 5, 10, 0.0));
}

TEST_CASE("A message larger than the bound is refused") {
  FairQueue<int> queue({.bytes = 100, .newest_wins = GENERATE(false, true)});
  CHECK_FALSE(queue.push(7, 1, 101, 0.0));
  CHECK(queue.size() == 0);
  CHECK(queue.push(7, 2, 100, 0.0));
}

TEST_CASE("Each peer's messages are served as a burst and then at the rate") {
  FairQueue<int> queue({.per_second = 10.0, .burst = 5.0});
  for (int i = 0; i < 1000; ++i) {
    queue.push(7, i, 1, 100.0);
    queue.push(8, i, 1, 100.0);
  }
  CHECK(drain(queue, 100.0).size() == 2 * 5);
  REQUIRE(queue.wait_s(100.0));
  CHECK(*queue.wait_s(100.0) == Approx(0.1));
  std::size_t served = 0;
  for (double now_s = 100.0; now_s < 110.0; now_s += 0.01) served += drain(queue, now_s).size();
  CHECK(served >= 2 * 98);
  CHECK(served <= 2 * 100);
  CHECK(drain(queue, 1000.0).size() == 2 * 5);  // a silence makes no more than a burst
}

constexpr int kTicksInAnHour = 7200;

int statuses_in_an_hour(std::size_t others) {
  StatusPace pace;
  int sent = 0;
  for (int tick = 0; tick < kTicksInAnHour; ++tick) sent += pace.is_due(0, others) ? 1 : 0;
  return sent;
}

TEST_CASE("statuses that a robot receives in an hour do not grow with a large team") {
  CHECK(statuses_in_an_hour(0) == Approx(kTicksInAnHour / 2).epsilon(0.01));
  CHECK(statuses_in_an_hour(10) == Approx(kTicksInAnHour / 2).epsilon(0.01));
  CHECK(statuses_in_an_hour(11) == Approx(kTicksInAnHour / 3).epsilon(0.01));
  // Beside the statuses of the first ten seconds.
  CHECK(statuses_in_an_hour(99) * 99 <= 1.05 * statuses_in_an_hour(10) * 10);
}

TEST_CASE("a change that other robots wait for is sent at once") {
  StatusPace pace;
  for (int tick = 0; tick <= 20; ++tick) (void)pace.is_due(0, 99);
  CHECK(pace.is_due(1, 99));
  CHECK_FALSE(pace.is_due(1, 99));
  CHECK(pace.is_due(2, 99));
  int ticks = 1;
  while (!pace.is_due(2, 99)) ++ticks;
  CHECK(ticks == 20);
}

}  // namespace
}  // namespace km
