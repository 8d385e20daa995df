#include <catch2/catch.hpp>
#include <map>

#include "modules/place_recognition/candidate_filter.hpp"
#include "test/modules/place_recognition/toy_vocabulary.hpp"

namespace km {
namespace {

constexpr std::size_t kWords = 100;

Stamp at_s(double seconds) {
  return nanoseconds(1000.0 + seconds);
}

// checks.md L1.
TEST_CASE("The same view seen by two robots is found once", "[place_recognition]") {
  CandidateFilter robot_0({}, kWords);
  const BowVector view = toy_vector({1, 2, 3, 4});
  robot_0.add(view, at_s(0));
  const CandidateSearch first = robot_0.search(view, nullptr);  // robot 1, pose 0
  CHECK(first.status == SearchStatus::kNoPrevious);
  CHECK(first.candidates.empty());
  const CandidateSearch second = robot_0.search(view, &view);  // robot 1, pose 1
  CHECK(second.normalizer == Approx(1.0));
  REQUIRE(second.candidates.size() == 1);
  CHECK(second.candidates[0].index == 0);
  CHECK(second.candidates[0].similarity == Approx(1.0));
}

TEST_CASE("The threshold applies to the ratio of scores", "[place_recognition]") {
  CandidateFilter filter({.similarity_threshold = 0.5}, kWords);
  filter.add(toy_vector({1, 2, 50, 51, 52, 53, 54, 55}), at_s(0));   // score 0.25
  filter.add(toy_vector({1, 50, 51, 52, 53, 54, 55, 56}), at_s(1));  // score 0.125
  const BowVector query = toy_vector({1, 2, 3, 4, 5, 6, 7, 8});
  const BowVector previous = toy_vector({5, 6, 7, 8, 60, 61, 62, 63});  // score 0.5
  const CandidateSearch search = filter.search(query, &previous);
  CHECK(search.normalizer == Approx(0.5));
  REQUIRE(search.candidates.size() == 1);  // 0.25 / 0.5 reaches it, 0.125 / 0.5 does not
  CHECK(search.candidates[0].index == 0);
  CHECK(search.candidates[0].similarity == Approx(0.5));
  CHECK(search.compared == 2);
  CHECK(search.above == 1);
  CHECK(search.best_similarity == Approx(0.5));
}

TEST_CASE("A query unlike the keyframe before it is not used", "[place_recognition]") {
  CandidateFilter filter({.min_normalizer = 0.3}, kWords);
  const BowVector query = toy_vector({1, 2, 3, 4});
  filter.add(query, at_s(0));
  const BowVector unlike = toy_vector({4, 5, 6, 7});  // score 0.25
  const CandidateSearch search = filter.search(query, &unlike);
  CHECK(search.status == SearchStatus::kLowNormalizer);
  CHECK(search.normalizer == Approx(0.25));
  CHECK(search.candidates.empty());
  const BowVector like = toy_vector({3, 4, 5, 6});
  CHECK(filter.search(query, &like).status == SearchStatus::kSearched);
}

TEST_CASE("A normaliser of zero is refused even where no minimum is set", "[place_recognition]") {
  CandidateFilter filter({.min_normalizer = 0.0}, kWords);
  filter.add(toy_vector({1}), at_s(0));
  const BowVector unlike = toy_vector({2});
  CHECK(filter.search(toy_vector({1}), &unlike).status == SearchStatus::kLowNormalizer);
  CHECK(filter.search({}, &unlike).status == SearchStatus::kLowNormalizer);
}

TEST_CASE("Neighbours in time inside one robot are no candidates", "[place_recognition]") {
  CandidateFilter filter({.max_candidates = 100, .min_gap_s = 10.0}, kWords);
  const BowVector view = toy_vector({1, 2, 3});
  CHECK(filter.search_own(view, at_s(0)).status == SearchStatus::kNoPrevious);
  for (int i = 0; i <= 12; ++i) filter.add(view, at_s(i));
  CHECK(filter.search_own(view, at_s(9.5)).candidates.empty());
  CHECK(filter.search_own(view, at_s(10)).candidates.size() == 1);  // the gap itself counts
  CHECK(filter.search_own(view, at_s(13)).candidates.size() == 4);
  CHECK(filter.search(view, &view).candidates.size() == 13);  // another robot: no such rule
}

TEST_CASE("The best candidates are kept, one per place", "[place_recognition]") {
  const double separation_s = GENERATE(0.0, 2.0);
  CandidateFilter filter({.max_candidates = 3, .candidate_separation_s = separation_s}, kWords);
  const BowVector view = toy_vector({1, 2, 3, 4});
  const BowVector part = toy_vector({1, 2, 3, 9});
  filter.add(part, at_s(0));
  filter.add(view, at_s(1));
  filter.add(part, at_s(2));
  filter.add(part, at_s(3));
  filter.add(part, at_s(50));
  const CandidateSearch search = filter.search(view, &view);
  CHECK(search.above == 5);
  std::vector<std::size_t> indices;
  for (const PlaceCandidate& candidate : search.candidates) indices.push_back(candidate.index);
  if (separation_s == 0.0)
    CHECK(indices == std::vector<std::size_t>{1, 0, 2});
  else
    CHECK(indices == std::vector<std::size_t>{1, 3, 4});
}

TEST_CASE("Candidates support each other when they are neighbours", "[place_recognition]") {
  CandidateFilter filter({}, kWords);
  const BowVector view = toy_vector({1, 2, 3, 4});
  const BowVector other = toy_vector({7, 8});
  for (int i = 0; i < 12; ++i) filter.add(i == 1 || i == 7 || i == 10 ? view : other, at_s(i));
  std::map<std::size_t, int> support;
  for (const PlaceCandidate& candidate : filter.search(view, &view).candidates)
    support[candidate.index] = candidate.support;
  CHECK(support == std::map<std::size_t, int>{{1, 1}, {7, 2}, {10, 2}});
}

TEST_CASE("The filter refuses what it cannot use and stays as it was", "[place_recognition]") {
  CHECK_THROWS_AS(CandidateFilter({.similarity_threshold = -1.0}, kWords), ConfigError);
  CandidateFilter filter({}, kWords);
  filter.add(toy_vector({1}), at_s(5));
  CHECK_THROWS_AS(filter.add(toy_vector({1}), at_s(4)), std::invalid_argument);
  CHECK_THROWS_AS(filter.add(toy_vector({kWords}), at_s(6)), std::invalid_argument);
  CHECK(filter.size() == 1);
}

}  // namespace
}  // namespace km
