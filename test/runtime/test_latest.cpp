#include <catch2/catch.hpp>
#include <memory>
#include <thread>

#include "runtime/latest.hpp"

namespace km {
namespace {

TEST_CASE("Of what was put the newest is taken, once", "[runtime]") {
  Latest<int> latest;
  CHECK(latest.take() == nullptr);
  const auto old = std::make_shared<const int>(1);
  latest.put(old);
  latest.put(std::make_shared<const int>(2));
  CHECK(old.use_count() == 1);  // nothing is held that is not wanted any more
  const auto taken = latest.take();
  REQUIRE(taken != nullptr);
  CHECK(*taken == 2);
  CHECK(latest.take() == nullptr);
}

TEST_CASE("After the end nothing is put, and what was there can be taken", "[runtime]") {
  Latest<int> latest;
  latest.put(std::make_shared<const int>(1));
  latest.close();
  latest.put(std::make_shared<const int>(2));
  CHECK(*latest.take() == 1);
  CHECK(latest.take() == nullptr);
}

TEST_CASE("A taker sees ever newer values while others are put, and the last", "[runtime]") {
  constexpr int kLast = 10000;
  Latest<int> latest;
  std::thread putter([&] {
    for (int i = 1; i <= kLast; ++i) latest.put(std::make_shared<const int>(i));
  });
  int seen = 0;
  bool ascending = true;
  while (seen < kLast)
    if (const auto value = latest.take()) {
      ascending = ascending && *value > seen;
      seen = *value;
    }
  putter.join();
  CHECK(ascending);
}

}  // namespace
}  // namespace km
