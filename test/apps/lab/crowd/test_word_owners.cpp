#include <catch2/catch.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <random>

#include "apps/lab/crowd/place_sketch.hpp"
#include "apps/lab/crowd/repeated_names.hpp"
#include "apps/lab/crowd/sketch_index.hpp"
#include "apps/lab/crowd/word_owners.hpp"
#include "test/modules/place_recognition/toy_vocabulary.hpp"

namespace km {
namespace {

constexpr std::uint32_t kOwnedWords = 8000;

std::vector<RobotId> robots_to(RobotId count) {
  std::vector<RobotId> robots(count);
  std::iota(robots.begin(), robots.end(), RobotId{0});
  return robots;
}

TEST_CASE("Every robot owns about equally many words", "[place_recognition]") {
  const RobotId count = GENERATE(RobotId{2}, RobotId{10}, RobotId{100});
  CAPTURE(count);
  const std::vector<RobotId> robots = robots_to(count);
  std::map<RobotId, int> owned;
  for (std::uint32_t word = 0; word < kOwnedWords; ++word) ++owned[owner_of(word, robots)];
  const double mean = static_cast<double>(kOwnedWords) / count;
  // Binomial numbers of 100 robots: beyond 5 sigma with a probability of 6e-5.
  const double bound = 5.0 * std::sqrt(mean);
  for (const RobotId robot : robots) CHECK(std::abs(owned[robot] - mean) < bound);
}

TEST_CASE("Only the words of a robot that leaves or joins change their owner",
          "[place_recognition]") {
  const std::vector<RobotId> all = {3, 17, 18, 900, 65535};
  const RobotId leaves = GENERATE(RobotId{3}, RobotId{18}, RobotId{65535});
  CAPTURE(leaves);
  std::vector<RobotId> rest = all;
  std::erase(rest, leaves);
  std::reverse(rest.begin(), rest.end());  // the order does not matter
  std::size_t moved = 0;
  for (std::uint32_t word = 0; word < kOwnedWords; ++word) {
    const RobotId before = owner_of(word, all);
    if (before != leaves) {
      REQUIRE(owner_of(word, rest) == before);
    } else {
      ++moved;
    }
  }
  CHECK(moved > 0);
}

TEST_CASE("The heaviest words are those of the largest weights", "[place_recognition]") {
  const BowVector image{{2, 5, 7, 9}, {0.2F, 0.4F, 0.2F, 0.3F}};
  CHECK(heaviest_words(image, 2) == std::vector<std::uint32_t>{5, 9});
  CHECK(heaviest_words(image, 3) == std::vector<std::uint32_t>{2, 5, 9});  // 2 before 7
  CHECK(heaviest_words(image, 9) == image.words);
  CHECK(heaviest_words({}, 3).empty());

  // Word 1 has no weight, so that the vector does not contain it.
  const BagOfWords bag{{1, 9}, {2, 1}, {5, 2}, {7, 1}, {9, 1}};
  CHECK(sketch_of(bag, image, 2) == BagOfWords{{5, 2}, {9, 1}});
  CHECK(sketch_of(bag, image, 9) == BagOfWords{{2, 1}, {5, 2}, {7, 1}, {9, 1}});
}

TEST_CASE("Images that share a heaviest word share an owner", "[place_recognition]") {
  const std::vector<RobotId> robots = robots_to(50);
  const BowVector a{{10, 20, 30}, {0.5F, 0.3F, 0.2F}};
  const BowVector b{{20, 40, 50}, {0.4F, 0.35F, 0.25F}};
  const std::vector<RobotId> of_a = owners_of(a, 2, robots);
  const std::vector<RobotId> of_b = owners_of(b, 2, robots);
  const RobotId shared = owner_of(20, robots);
  CHECK(std::ranges::binary_search(of_a, shared));
  CHECK(std::ranges::binary_search(of_b, shared));
  CHECK(std::ranges::is_sorted(of_a));
  CHECK(owners_of(a, 3, robots_to(1)) == std::vector<RobotId>{0});
  CHECK(owners_of(a, 3, {}).empty());
}

TEST_CASE("An index names the robots with similar keyframes, each once", "[place_recognition]") {
  SketchIndex index({.min_score = 0.5, .max_robots = 2}, 20);
  const BowVector here = toy_vector({0, 1, 2, 3});
  CHECK(index.add({1, 0}, here).empty());
  CHECK(index.add({1, 1}, toy_vector({0, 1, 2, 4})).empty());  // its own keyframes do not count
  CHECK(index.add({2, 0}, toy_vector({0, 1, 10, 11})).size() == 1);
  CHECK(index.add({3, 0}, toy_vector({10, 11, 12, 13})).at(0).keyframe == KeyframeId{2, 0});
  CHECK(index.add({4, 0}, toy_vector({3, 14, 15, 16})).empty());  // 1 of 4 words: 0.25

  const std::vector<SketchMatch> named = index.add({5, 0}, here);
  REQUIRE(named.size() == 2);
  CHECK(named[0].keyframe == KeyframeId{1, 0});
  CHECK(named[0].score == Approx(1.0));
  CHECK(named[1].keyframe == KeyframeId{2, 0});
  CHECK(named[1].score == Approx(0.5));

  CHECK(index.size() == 6);
  CHECK(index.add({5, 0}, here).empty());  // stored already
  CHECK(index.size() == 6);
}

TEST_CASE("An index ignores the keyframes of a robot that has restarted", "[place_recognition]") {
  SketchIndex index({.min_score = 0.5, .max_robots = 2}, 20);
  const BowVector here = toy_vector({0, 1, 2, 3});
  CHECK(index.add({1, 0}, here).empty());
  index.forget(1);
  CHECK(index.add({2, 0}, here).empty());
  // The same index is another keyframe.
  REQUIRE(index.add({1, 0}, here).size() == 1);
  CHECK(index.add({3, 0}, here).size() == 2);
}

TEST_CASE("A name counts if the robot was named for another keyframe in the window",
          "[place_recognition]") {
  RepeatedNames names(5);
  CHECK_FALSE(names.add(1, 10));
  CHECK_FALSE(names.add(2, 12));
  CHECK(names.add(1, 15));
  CHECK_FALSE(names.add(2, 18));
  CHECK(names.add(1, 20));
  names.forget(1);
  CHECK_FALSE(names.add(1, 21));
  CHECK(RepeatedNames(0).add(1, 10));
}

TEST_CASE("An index names the robots that brute force names", "[place_recognition]") {
  const auto seed = GENERATE(1U, 2U, 3U);
  CAPTURE(seed);
  std::mt19937 random(seed);
  const SketchIndexBounds bounds{.min_score = 0.3, .max_robots = 100};
  SketchIndex index(bounds, 60);
  std::vector<std::pair<RobotId, BowVector>> stored;
  for (std::uint32_t i = 0; i < 200; ++i) {
    BowVector sketch;
    for (std::uint32_t word = 0; word < 60; ++word)
      if (random() % 6 == 0) sketch.words.push_back(word);
    sketch.weights.assign(sketch.words.size(), 1.0F / static_cast<float>(sketch.words.size()));
    const auto robot = static_cast<RobotId>(random() % 12);
    std::map<RobotId, double> expected;
    for (const auto& [other, vector] : stored)
      if (other != robot && score(sketch, vector) >= bounds.min_score)
        expected[other] = std::max(expected[other], score(sketch, vector));
    std::map<RobotId, double> named;
    for (const SketchMatch& match : index.add({robot, i}, sketch))
      named[match.keyframe.robot] = match.score;
    REQUIRE(named.size() == expected.size());
    for (const auto& [other, best] : expected) CHECK(named[other] == Approx(best).margin(1e-5));
    stored.emplace_back(robot, std::move(sketch));
  }
}

}  // namespace
}  // namespace km
