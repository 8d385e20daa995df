#include <algorithm>
#include <catch2/catch.hpp>
#include <random>
#include <set>
#include <vector>

#include "runtime/dds/sequence_tracker.hpp"

namespace km {
namespace {

TEST_CASE("Duplicates and gaps agree with a set of all numbers, in any order", "[sequence]") {
  const auto seed = GENERATE(range(0U, 50U));
  const bool from_zero = GENERATE(true, false);
  CAPTURE(seed, from_zero);
  std::mt19937 rng(seed);
  std::uniform_int_distribution<std::uint32_t> number(5, 200);
  SequenceTracker tracker(from_zero);
  std::set<std::uint32_t> seen;
  for (int i = 0; i < 300; ++i) {
    const std::uint32_t n = number(rng);
    const bool fresh = tracker.is_new(n);
    REQUIRE(fresh == seen.insert(n).second);
    const std::uint32_t first = from_zero ? 0 : *seen.begin();
    REQUIRE(tracker.missing() == *seen.rbegin() - first + 1 - seen.size());
  }
}

TEST_CASE("A stream that skips every other number does not exhaust the memory", "[sequence]") {
  constexpr std::uint32_t kCount = 10 * SequenceTracker::kMaxIntervals;
  SequenceTracker tracker(true);
  for (std::uint32_t i = 0; i < kCount; ++i) CHECK(tracker.is_new(2 * i + 1));
  CHECK(tracker.missing() == kCount);
  CHECK_FALSE(tracker.is_new(2 * kCount - 1));  // a late duplicate
  CHECK(tracker.is_new(2 * kCount - 2));        // a late gap filled
  CHECK(tracker.missing() == kCount - 1);
  CHECK_FALSE(tracker.is_new(2));  // given up: better lost than twice
}

TEST_CASE("The largest number counts like any other", "[sequence]") {
  SequenceTracker tracker(false);
  CHECK(tracker.is_new(0xFFFFFFFFU));
  CHECK_FALSE(tracker.is_new(0xFFFFFFFFU));
  CHECK(tracker.is_new(0));
  CHECK(tracker.missing() == 0xFFFFFFFEU);
}

}  // namespace
}  // namespace km
