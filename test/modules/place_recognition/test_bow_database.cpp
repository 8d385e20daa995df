#include "modules/place_recognition/bow_database.hpp"
#include "modules/place_recognition/place_database.hpp"
#include "test/modules/place_recognition/toy_vocabulary.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

constexpr double kScoreTolerance = 1e-5;  // sums of up to 40 floats below 1

BowVector random_vector_of(std::uint32_t words, std::mt19937& rng) {
  std::map<std::uint32_t, float> entries;
  std::uniform_int_distribution<std::uint32_t> word(0, words - 1);
  std::uniform_real_distribution<float> weight(0.1F, 1.0F);
  for (int i = 0; i < 40; ++i) {
    const std::uint32_t drawn = word(rng);
    entries[drawn] = weight(rng);
  }
  BowVector vector;
  float total = 0.0F;
  for (const auto& entry : entries) total += entry.second;
  for (const auto& [w, value] : entries) {
    vector.words.push_back(w);
    vector.weights.push_back(value / total);
  }
  return vector;
}

// The definition: 1 - 0.5 * | v/|v| - w/|w| |_1 over dense vectors.
double score_by_definition(const BowVector& v, const BowVector& w, std::size_t words) {
  const auto dense = [&](const BowVector& sparse) {
    std::vector<double> values(words, 0.0);
    double norm = 0.0;
    for (std::size_t i = 0; i < sparse.words.size(); ++i) {
      values[sparse.words[i]] = static_cast<double>(sparse.weights[i]);
      norm += static_cast<double>(sparse.weights[i]);
    }
    for (double& value : values) value /= norm;
    return values;
  };
  const auto a = dense(v);
  const auto b = dense(w);
  double difference = 0.0;
  for (std::size_t i = 0; i < words; ++i) difference += std::abs(a[i] - b[i]);
  return 1.0 - 0.5 * difference;
}

TEST_CASE("The score is 1 - half the L1 distance of the unit vectors") {
  CHECK(score(toy_vector({1, 2, 3, 4}), toy_vector({3, 4, 5, 6})) == Approx(0.5));
  CHECK(score(toy_vector({1, 2}), toy_vector({3})) == 0.0);
  CHECK(score({}, toy_vector({3})) == 0.0);
  std::mt19937 rng(1);
  for (int trial = 0; trial < 50; ++trial) {
    const BowVector v = random_vector_of(100, rng);
    const BowVector w = random_vector_of(100, rng);
    CHECK(score(v, w) == Approx(score_by_definition(v, w, 100)).margin(kScoreTolerance));
    CHECK(score(v, w) == score(w, v));
  }
}

TEST_CASE("The inverted index finds the same images as comparing every pair") {
  const auto seed = GENERATE(range(0U, 5U));
  CAPTURE(seed);
  std::mt19937 rng(seed);
  constexpr std::uint32_t kWords = 300;
  std::vector<BowVector> images;
  BowDatabase database(kWords);
  for (std::size_t i = 0; i < 200; ++i) {
    images.push_back(random_vector_of(kWords, rng));
    CHECK(database.add(images.back()) == i);
  }
  const BowVector query = random_vector_of(kWords, rng);
  const std::size_t last = GENERATE(120U, 200U, 5000U);
  const double min_score = 0.08;
  CAPTURE(last);

  std::vector<std::size_t> expected;
  for (std::size_t i = 0; i < std::min(last, images.size()); ++i)
    if (score(query, images[i]) >= min_score) expected.push_back(i);
  const auto found = database.query(query, {.last = last, .min_score = min_score});
  std::vector<std::size_t> indices;
  for (const BowMatch& match : found) {
    indices.push_back(match.index);
    CHECK(static_cast<double>(match.score) ==
          Approx(score(query, images[match.index])).margin(kScoreTolerance));
  }
  std::ranges::sort(indices);
  CHECK(indices == expected);
  CHECK(std::ranges::is_sorted(found, std::ranges::greater(), &BowMatch::score));
  const auto few = database.query(query, {.last = last, .min_score = min_score, .max_matches = 3});
  REQUIRE(few.size() == std::min<std::size_t>(3, found.size()));
  CHECK(std::equal(few.begin(), few.end(), found.begin()));
}

TEST_CASE("An invalid vector is refused and changes nothing") {
  BowDatabase database(10);
  const auto check_refused = [&](const BowVector& vector, const char* reason) {
    CHECK_THROWS_WITH(database.add(vector), Contains(reason));
  };
  check_refused({{1, 10}, {0.5F, 0.5F}}, "word 10 is not in the vocabulary of 10");
  check_refused({{1, 1}, {0.5F, 0.5F}}, "word 1 is not above the one before");
  check_refused({{1, 2}, {0.5F, 0.0F}}, "word 2 has weight 0");
  check_refused({{1, 2}, {std::nanf(""), 0.5F}}, "word 1 has weight nan");
  check_refused({{1, 2}, {1.0F}}, "2 words with 1 weights");
  CHECK(database.size() == 0);
  CHECK(database.query(toy_vector({1})).empty());
}

constexpr std::size_t kWords = 100;

Stamp at_s(double seconds) {
  return nanoseconds(1000.0 + seconds);
}

TEST_CASE("The threshold applies to the ratio of scores") {
  PlaceDatabase filter({.similarity_threshold = 0.5}, kWords);
  filter.add(toy_vector({1, 2, 50, 51, 52, 53, 54, 55}), at_s(0));   // score 0.25
  filter.add(toy_vector({1, 50, 51, 52, 53, 54, 55, 56}), at_s(1));  // score 0.125
  const BowVector query = toy_vector({1, 2, 3, 4, 5, 6, 7, 8});
  const BowVector previous = toy_vector({5, 6, 7, 8, 60, 61, 62, 63});  // score 0.5
  const CandidateSearch search = filter.search(query, score(query, previous));
  CHECK(search.normalizer == Approx(0.5));
  REQUIRE(search.candidates.size() == 1);  // 0.25 / 0.5 reaches it, 0.125 / 0.5 does not
  CHECK(search.candidates[0].index == 0);
  CHECK(search.candidates[0].similarity == Approx(0.5));
}

TEST_CASE("A query unlike the keyframe before it is not used") {
  const double normalizer = GENERATE(0.0, 0.049, std::nan(""));
  PlaceDatabase filter({}, kWords);
  const BowVector query = toy_vector({1, 2, 3, 4});
  filter.add(query, at_s(0));
  CHECK(filter.search(query, normalizer).candidates.empty());
  CHECK(filter.search(query, PlaceDatabase::kMinNormalizer).candidates.size() == 1);
}

TEST_CASE("Neighbours in time inside one robot are no candidates") {
  PlaceDatabase filter({.max_candidates = 100}, kWords);
  const BowVector view = toy_vector({1, 2, 3});
  CHECK(filter.search_own(view, at_s(0)).normalizer == 0.0);
  for (int i = 0; i <= 12; ++i) filter.add(view, at_s(i));
  CHECK(filter.search_own(view, at_s(9.5)).candidates.empty());
  CHECK(filter.search_own(view, at_s(10)).candidates.size() == 1);  // the gap itself counts
  CHECK(filter.search_own(view, at_s(13)).candidates.size() == 4);
  CHECK(filter.search(view, 1.0).candidates.size() == 13);  // another robot: no such rule
  filter.mark_odometry_break();
  CHECK(filter.search_own(view, at_s(13)).candidates.size() == 13);
  filter.add(view, at_s(13));
  CHECK(filter.search_own(view, at_s(14)).candidates.size() == 13);
}

TEST_CASE("The best candidates are kept") {
  PlaceDatabase filter({.max_candidates = 3}, kWords);
  const BowVector view = toy_vector({1, 2, 3, 4});
  const BowVector part = toy_vector({1, 2, 3, 9});
  for (int i = 0; i < 5; ++i) filter.add(i == 1 ? view : part, at_s(i));
  const CandidateSearch search = filter.search(view, 1.0);
  std::vector<std::size_t> indices;
  for (const PlaceCandidate& candidate : search.candidates) indices.push_back(candidate.index);
  CHECK(indices == std::vector<std::size_t>{1, 0, 2});
}

TEST_CASE("Candidates support each other when they are neighbours") {
  PlaceDatabase filter({}, kWords);
  const BowVector view = toy_vector({1, 2, 3, 4});
  const BowVector other = toy_vector({7, 8});
  for (int i = 0; i < 12; ++i) filter.add(i == 1 || i == 7 || i == 10 ? view : other, at_s(i));
  std::map<std::size_t, int> support;
  for (const PlaceCandidate& candidate : filter.search(view, 1.0).candidates)
    support[candidate.index] = candidate.support;
  CHECK(support == std::map<std::size_t, int>{{1, 1}, {7, 2}, {10, 2}});
}

TEST_CASE("A keyframe is a view if it differs from the view before it") {
  PlaceDatabase views({.new_view_score = 0.2}, kWords);
  const BowVector view = toy_vector({1, 2, 3, 4});
  const BowVector quarter = toy_vector({1, 5, 6, 7});  // score 0.25 with the view
  CHECK(views.is_view(view));
  CHECK_FALSE(views.is_view({}));
  views.add(view, at_s(0));
  CHECK_FALSE(views.is_view(quarter));
  views.pass(quarter, at_s(1));
  CHECK_THROWS_AS(views.pass(view, at_s(0.5)), std::invalid_argument);
  CHECK_THROWS_AS(views.add(view, at_s(0.5)), std::invalid_argument);
  CHECK(views.is_view(toy_vector({5, 6, 7, 8})));  // like the keyframe before, which is no view
  views.mark_odometry_break();
  CHECK(views.is_view(view));
}

TEST_CASE("The filter refuses invalid input and is unchanged") {
  CHECK_THROWS_AS(PlaceDatabase({.similarity_threshold = -1.0}, kWords), ConfigError);
  PlaceDatabase filter({}, kWords);
  filter.add(toy_vector({1}), at_s(5));
  CHECK_THROWS_AS(filter.add(toy_vector({1}), at_s(4)), std::invalid_argument);
  CHECK_THROWS_AS(filter.add(toy_vector({kWords}), at_s(6)), std::invalid_argument);
  CHECK(filter.size() == 1);
}

}  // namespace
}  // namespace km
