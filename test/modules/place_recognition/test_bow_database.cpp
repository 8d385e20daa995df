#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <random>

#include "modules/place_recognition/bow_database.hpp"
#include "modules/place_recognition/vocabulary_file.hpp"
#include "modules/place_recognition/vocabulary_training.hpp"
#include "test/modules/place_recognition/synthetic_orb.hpp"
#include "test/modules/place_recognition/toy_vocabulary.hpp"

using Catch::Matchers::Contains;

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

TEST_CASE("The score is 1 - half the L1 distance of the unit vectors", "[place_recognition]") {
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

TEST_CASE("The inverted index finds what comparing every pair finds", "[place_recognition]") {
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
  const std::size_t first = GENERATE(0U, 37U);
  const std::size_t last = GENERATE(120U, 200U, 5000U);
  const double min_score = 0.08;
  CAPTURE(first, last);

  const BowMatches found =
      database.query(query, {.first = first, .last = last, .min_score = min_score});
  std::size_t compared = 0;
  std::size_t above = 0;
  double best = 0.0;
  for (std::size_t i = first; i < std::min(last, images.size()); ++i) {
    const double expected = score(query, images[i]);
    compared += expected > 0.0 ? 1U : 0U;
    above += expected >= min_score ? 1U : 0U;
    best = std::max(best, expected);
    const auto match = std::find_if(found.best.begin(), found.best.end(),
                                    [&](const BowMatch& m) { return m.index == i; });
    REQUIRE((match != found.best.end()) == (expected >= min_score));
    if (match != found.best.end())
      CHECK(static_cast<double>(match->score) == Approx(expected).margin(kScoreTolerance));
  }
  CHECK(found.compared == compared);
  CHECK(found.above == above);
  CHECK(static_cast<double>(found.best_score) == Approx(best).margin(kScoreTolerance));
  CHECK(std::is_sorted(found.best.begin(), found.best.end(),
                       [](const auto& a, const auto& b) { return a.score > b.score; }));

  const BowMatches few = database.query(
      query, {.first = first, .last = last, .min_score = min_score, .max_matches = 3});
  REQUIRE(few.best.size() == std::min<std::size_t>(3, found.best.size()));
  CHECK(std::equal(few.best.begin(), few.best.end(), found.best.begin()));
  CHECK(few.above == above);
}

TEST_CASE("Equal scores are listed by index", "[place_recognition]") {
  BowDatabase database(10);
  for (int i = 0; i < 5; ++i) database.add(toy_vector({2, 4}));
  const BowMatches found = database.query(toy_vector({4, 5}), {.max_matches = 3});
  REQUIRE(found.best.size() == 3);
  for (std::size_t i = 0; i < 3; ++i) CHECK(found.best[i] == BowMatch{i, 0.5F});
}

TEST_CASE("An empty database, range or vector matches nothing", "[place_recognition]") {
  BowDatabase database(10);
  CHECK(database.query(toy_vector({4})).best.empty());
  CHECK(database.add({}) == 0);
  CHECK(database.add(toy_vector({4})) == 1);
  CHECK(database.query({}).best.empty());
  CHECK(database.query(toy_vector({4}), {.first = 2}).best.empty());
  CHECK(database.query(toy_vector({4}), {.first = 1, .last = 1}).best.empty());
  CHECK(database.query(toy_vector({4}), {.first = 1, .last = 2}).best.size() == 1);
}

TEST_CASE("A vector that is none is refused and changes nothing", "[place_recognition]") {
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
  CHECK(database.query(toy_vector({1})).compared == 0);
}

// checks.md L5: the demonstration of DBoW2.
TEST_CASE("Each of four images matches itself best, after a file as before",
          "[place_recognition]") {
  SyntheticOrb world(3, 4);
  const auto images = world.images(4, 300, 5);
  const VocabularyData trained = train_vocabulary(images, {.branching = 9, .depth = 3});
  const Vocabulary vocabulary(trained);
  const Vocabulary loaded(deserialize(serialize(trained), "memory"));
  BowDatabase database(vocabulary.size());
  for (const auto& image : images) database.add(vocabulary.transform(image));
  for (std::size_t i = 0; i < images.size(); ++i) {
    const BowMatches found = database.query(loaded.transform(images[i]));
    REQUIRE_FALSE(found.best.empty());
    CHECK(found.best[0].index == i);
    CHECK(found.best[0].score == Approx(1.0F).margin(1e-5));  // sum of 300 floats
  }
}

}  // namespace
}  // namespace km
