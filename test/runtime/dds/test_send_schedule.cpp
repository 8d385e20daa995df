#include "runtime/dds/send_schedule.hpp"

#include <catch2/catch.hpp>
#include <string>
#include <vector>

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

TEST_CASE("Messages are sent by priority and in order within a priority", "[budget]") {
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

TEST_CASE("The bytes sent equal the budget for messages of any size", "[budget]") {
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

TEST_CASE("Statuses never wait, and are counted", "[budget]") {
  Schedule schedule({.bytes_per_s = 1000.0});
  for (int k = 0; k < 10; ++k) schedule.push(entry(kPresence, k), 0.0);
  schedule.push(entry(kClosures, 10), 0.0);
  CHECK(sent(schedule, 0.0).size() == 10);
  CHECK(sent(schedule, 0.99).empty());
  CHECK(sent(schedule, 1.01) == std::vector<int>{10});
}

TEST_CASE("Bags of words that have waited follow new ones", "[budget]") {
  Schedule schedule({.bytes_per_s = 1000.0});
  for (int k = 0; k < 60; ++k) schedule.push(entry(kWords, k), 0.0);
  CHECK(sent(schedule, 0.0) == std::vector<int>{0});
  schedule.push(entry(kWords, 100), 6.0);
  schedule.push(entry(kMesh, 200), 6.0);
  CHECK(sent(schedule, 6.0) == std::vector<int>{100, 1, 2});
  CHECK(schedule.held_back().at("t").delayed == TrafficCount{2, 200});
}

TEST_CASE("Only the newest of a waiting state is kept, at the position of the first", "[budget]") {
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

TEST_CASE("Requests that are too old to be answered are dropped", "[budget]") {
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

TEST_CASE("A run's total is kept, and the most important has some of it left", "[budget]") {
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

TEST_CASE("Messages without room and messages left at the end are dropped and counted",
          "[budget]") {
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

TEST_CASE("Bytes that DDS sends by itself are charged to the budget", "[budget]") {
  Schedule schedule({.bytes_per_s = 1000.0});
  schedule.settle(500, 0.0);
  schedule.push(entry(kClosures, 1), 0.0);
  CHECK(sent(schedule, 0.49).empty());
  CHECK(sent(schedule, 0.51) == std::vector<int>{1});
  schedule.settle(600, 0.51);  // that very message
  schedule.push(entry(kClosures, 2), 0.51);
  CHECK(sent(schedule, 0.62) == std::vector<int>{2});
}

TEST_CASE("Messages without a reader wait and delay no others", "[budget]") {
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

TEST_CASE("Without a budget nothing is dropped, replaced or counted", "[budget]") {
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

}  // namespace
}  // namespace km
