#include <catch2/catch.hpp>

#include <algorithm>
#include <map>
#include <memory>
#include <numeric>
#include <random>

#include "modules/place_recognition/peer_history.hpp"
#include "test/modules/place_recognition/toy_vocabulary.hpp"

namespace km {
namespace {

// A vector that contains the number of its keyframe.
BowVector vector_of(std::uint32_t index) {
  return toy_vector({index});
}

std::uint32_t index_in(const BowVector& vector) {
  return vector.words.at(0);
}

TEST_CASE("Keyframes in order are searched for at once", "[place_recognition]") {
  PeerHistory history(10);
  for (std::uint32_t i = 0; i < 20; ++i) {
    const auto queries = history.add(i, vector_of(i));
    REQUIRE(queries.size() == 1);
    CHECK(queries[0].index == i);
    CHECK(index_in(*queries[0].vector) == i);
    if (i == 0)
      CHECK(queries[0].previous == nullptr);
    else
      CHECK(index_in(*queries[0].previous) == i - 1);
  }
  CHECK(history.waiting() == 0);
}

TEST_CASE("A keyframe without words is no query, and the one before it normalises the next",
          "[place_recognition]") {
  const std::vector<std::uint32_t> order = GENERATE(
      values<std::vector<std::uint32_t>>({{0, 1, 2, 3, 4}, {0, 1, 3, 4, 2}, {0, 3, 2, 1, 4}}));
  PeerHistory history(10);
  std::map<std::uint32_t, std::uint32_t> previous;
  for (const std::uint32_t i : order)
    for (const PeerQuery& query : history.add(i, i == 2 || i == 3 ? BowVector() : vector_of(i)))
      if (query.previous) previous[query.index] = index_in(*query.previous);
  CHECK(previous == std::map<std::uint32_t, std::uint32_t>{{1, 0}, {4, 1}});
  CHECK(history.waiting() == 0);
}

TEST_CASE("In any order each keyframe is searched for once, with its predecessor",
          "[place_recognition]") {
  const auto seed = GENERATE(range(0U, 20U));
  CAPTURE(seed);
  std::vector<std::uint32_t> order(60);
  std::iota(order.begin(), order.end(), 0U);
  std::shuffle(order.begin(), order.end(), std::mt19937(seed));
  PeerHistory history(100);
  std::map<std::uint32_t, int> seen;
  std::map<std::uint32_t, std::weak_ptr<const BowVector>> stored;
  for (const std::uint32_t i : order)
    for (const PeerQuery& query : history.add(i, vector_of(i))) {
      ++seen[query.index];
      stored[query.index] = query.vector;
      CHECK(index_in(*query.vector) == query.index);
      if (query.index == 0) {
        CHECK(query.previous == nullptr);
      } else {
        REQUIRE(query.previous != nullptr);
        CHECK(index_in(*query.previous) == query.index - 1);
      }
    }
  CHECK(seen.size() == order.size());
  CHECK(std::all_of(seen.begin(), seen.end(), [](const auto& entry) { return entry.second == 1; }));
  CHECK(history.waiting() == 0);
  for (const auto& [index, vector] : stored) CHECK(vector.expired() == (index != 59));
}

TEST_CASE("The nearest earlier keyframe replaces a missing predecessor", "[place_recognition]") {
  PeerHistory history(2);
  history.add(0, vector_of(0));
  CHECK(history.add(5, vector_of(5)).empty());
  CHECK(history.add(6, vector_of(6)).size() == 1);  // its predecessor has arrived
  const auto overdue = history.add(7, vector_of(7));
  REQUIRE(overdue.size() == 2);
  CHECK(overdue[0].index == 5);
  CHECK(index_in(*overdue[0].previous) == 0);
  CHECK(overdue[1].index == 7);

  // The gap closes later: keyframe 0 is still there for 1.
  const auto late = history.add(1, vector_of(1));
  REQUIRE(late.size() == 1);
  CHECK(index_in(*late[0].previous) == 0);
}

TEST_CASE("Without any earlier keyframe there is no normaliser", "[place_recognition]") {
  PeerHistory history(1);
  CHECK(history.add(100, vector_of(100)).empty());
  const auto queries = history.add(101, vector_of(101));
  REQUIRE(queries.size() == 2);
  CHECK(queries[0].index == 100);
  CHECK(queries[0].previous == nullptr);
  CHECK(index_in(*queries[1].previous) == 100);
}

TEST_CASE("A repeated keyframe is ignored", "[place_recognition]") {
  PeerHistory history(10);
  history.add(0, vector_of(0));
  history.add(1, vector_of(1));
  CHECK(history.add(0, vector_of(9)).empty());
  CHECK(history.add(1, vector_of(9)).empty());
  CHECK(history.has(1));
  CHECK_FALSE(history.has(2));
  CHECK(history.add(~0U, vector_of(7)).empty());  // waits; its successor would be 0
  CHECK(history.add(2, vector_of(2)).size() == 1);
}

TEST_CASE("Only the newest of many gaps are kept", "[place_recognition]") {
  PeerHistory history(0);
  constexpr std::uint32_t kGaps = 3 * PeerHistory::kMaxGaps;
  std::vector<std::weak_ptr<const BowVector>> vectors;
  for (std::uint32_t k = 0; k < kGaps; ++k)
    for (const PeerQuery& query : history.add(2 * k, vector_of(2 * k)))
      vectors.push_back(query.vector);
  CHECK(vectors.size() + 1 >= kGaps);  // the last one waits for its turn
  const auto kept = std::ranges::count_if(vectors, [](const auto& v) { return !v.expired(); });
  CHECK(kept <= static_cast<std::ptrdiff_t>(PeerHistory::kMaxGaps) + 1);
  CHECK(vectors.front().expired());
  CHECK_FALSE(vectors.back().expired());
  // In a removed gap a keyframe has no normaliser. In a kept gap the keyframe before it is the
  // normaliser.
  const auto in_old_gap = history.add(1, vector_of(1));
  const auto in_new_gap = history.add(2 * kGaps - 5, vector_of(2 * kGaps - 5));
  std::map<std::uint32_t, bool> has_previous;
  for (const auto* queries : {&in_old_gap, &in_new_gap})
    for (const PeerQuery& query : *queries) has_previous[query.index] = query.previous != nullptr;
  CHECK_FALSE(has_previous.at(1));
  CHECK(has_previous.at(2 * kGaps - 5));
}

}  // namespace
}  // namespace km
