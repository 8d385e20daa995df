#include <catch2/catch.hpp>

#include <future>
#include <stdexcept>
#include <thread>

#include "runtime/bounded_queue.hpp"

namespace km {
namespace {

TEST_CASE("A queue hands out what was put in, in order, also after it is closed", "[queue]") {
  BoundedQueue<int> queue(3, Overflow::kBlock);
  for (int i = 0; i < 3; ++i) CHECK(queue.push(i));
  queue.close();
  CHECK_FALSE(queue.push(3));
  for (int i = 0; i < 3; ++i) CHECK(queue.pop() == i);
  CHECK(queue.pop() == std::nullopt);
}

TEST_CASE("A full queue that drops keeps the newest and counts the others", "[queue]") {
  BoundedQueue<int> queue(2, Overflow::kDropOldest);
  for (int i = 0; i < 5; ++i) queue.push(i);
  CHECK(queue.load().size == 2);
  CHECK(queue.load().high_water == 2);
  CHECK(queue.load().dropped == 3);
  CHECK(queue.pop() == 3);
  CHECK(queue.pop() == 4);
  CHECK(queue.load().size == 0);
}

TEST_CASE("A full queue that blocks loses nothing between two threads", "[queue]") {
  constexpr int kCount = 10000;
  BoundedQueue<int> queue(4, Overflow::kBlock);
  std::thread producer([&] {
    for (int i = 0; i < kCount; ++i) queue.push(i);
    queue.close();
  });
  int expected = 0;
  bool in_order = true;
  while (const auto value = queue.pop()) in_order &= *value == expected++;
  producer.join();
  CHECK(in_order);
  CHECK(expected == kCount);
  CHECK(queue.load().high_water <= 4);
  CHECK(queue.load().dropped == 0);
}

TEST_CASE("Closing a queue releases whoever waits on it", "[queue]") {
  BoundedQueue<int> empty(1, Overflow::kBlock);
  BoundedQueue<int> full(1, Overflow::kBlock);
  full.push(0);
  auto popped = std::async(std::launch::async, [&] { return empty.pop(); });
  auto pushed = std::async(std::launch::async, [&] { return full.push(1); });
  empty.close();
  full.close();
  CHECK(popped.get() == std::nullopt);
  CHECK_FALSE(pushed.get());
}

TEST_CASE("A queue without room is refused", "[queue]") {
  CHECK_THROWS_AS(BoundedQueue<int>(0, Overflow::kBlock), std::invalid_argument);
}

}  // namespace
}  // namespace km
