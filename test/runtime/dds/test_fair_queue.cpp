#include "runtime/dds/fair_queue.hpp"

#include <catch2/catch.hpp>
#include <vector>

namespace km {
namespace {

std::vector<int> drain(FairQueue<int>& queue, double now_s) {
  std::vector<int> served;
  while (const auto message = queue.pop(now_s)) served.push_back(*message);
  return served;
}

TEST_CASE("Peers are served in turn, each in order", "[fair_queue]") {
  FairQueue<int> queue({});
  for (const int i : {1, 2, 3, 4}) CHECK(queue.push(7, 70 + i, 1, 0.0));
  for (const int i : {1, 2}) CHECK(queue.push(9, 90 + i, 1, 0.0));
  CHECK(queue.push(8, 81, 1, 0.0));
  CHECK(queue.size() == 7);
  CHECK(drain(queue, 0.0) == std::vector<int>{71, 81, 91, 72, 92, 73, 74});
  CHECK(queue.size() == 0);
  CHECK_FALSE(queue.wait_s(0.0));
}

TEST_CASE("A peer that has no room loses its own newest, or its oldest", "[fair_queue]") {
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

TEST_CASE("A message larger than the bound is refused", "[fair_queue]") {
  FairQueue<int> queue({.bytes = 100, .newest_wins = GENERATE(false, true)});
  CHECK_FALSE(queue.push(7, 1, 101, 0.0));
  CHECK(queue.size() == 0);
  CHECK(queue.push(7, 2, 100, 0.0));
}

TEST_CASE("Each peer's messages are served as a burst and then at the rate", "[fair_queue]") {
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

}  // namespace
}  // namespace km
