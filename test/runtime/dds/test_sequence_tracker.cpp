#include <catch2/catch.hpp>
#include <random>
#include <set>

#include "runtime/dds/sequence_tracker.hpp"

namespace km {
namespace {

TEST_CASE("Duplicates agree with a set of all numbers, in any order", "[sequence]") {
  const auto seed = GENERATE(range(0U, 50U));
  CAPTURE(seed);
  std::mt19937 rng(seed);
  std::uniform_int_distribution<std::uint32_t> number(5, 200);
  SequenceTracker tracker;
  std::set<std::uint32_t> seen;
  for (int i = 0; i < 300; ++i) {
    const std::uint32_t n = number(rng);
    REQUIRE(tracker.is_new(n) == seen.insert(n).second);
  }
}

TEST_CASE("A stream that skips every other number does not exhaust the memory", "[sequence]") {
  constexpr std::uint32_t kCount = 10 * SequenceTracker::kMaxIntervals;
  SequenceTracker tracker;
  for (std::uint32_t i = 0; i < kCount; ++i) CHECK(tracker.is_new(2 * i + 1));
  CHECK_FALSE(tracker.is_new(2 * kCount - 1));  // a late duplicate
  CHECK(tracker.is_new(2 * kCount - 2));        // a late gap filled
  CHECK_FALSE(tracker.is_new(2));               // given up: better lost than twice
}

}  // namespace
}  // namespace km
