#include "modules/loop_closure/peer_words.hpp"
#include "modules/loop_closure/word_points.hpp"
#include "test/modules/loop_closure/synthetic_keyframes.hpp"
#include "test/modules/place_recognition/toy_vocabulary.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

const Vocabulary& vocabulary() {
  static const Vocabulary toy = toy_vocabulary(200);
  return toy;
}

constexpr std::size_t kAll = 1000;  // more than any keyframe here has

std::vector<std::uint32_t> all_words() {
  std::vector<std::uint32_t> words(200);
  for (std::uint32_t word = 0; word < words.size(); ++word) words[word] = word;
  return words;
}

// Both keyframes see `common` points of one place. The others have equal words at other places.
KeyframePair two_views(std::mt19937& rng, std::size_t common) {
  KeyframePair pair = make_keyframe_pair(rng, 150, {0.7, 0.3}, 1.0);
  const KeyframePair other = make_keyframe_pair(rng, 150, {0.7, 0.3}, 1.0);
  for (std::uint32_t i = 0; i < 150; ++i) {
    pair.from.descriptors[i] = pair.to.descriptors[i] = toy_descriptor(i);
    if (i >= common) pair.to.keypoints[i] = other.to.keypoints[i];
  }
  return pair;
}

TEST_CASE("Points of common words agree where the keyframes see one place") {
  std::mt19937 rng(3);
  const std::size_t common = GENERATE(0U, 20U, 60U, 150U);
  CAPTURE(common);
  const KeyframePair pair = two_views(rng, common);
  const WordPoints sent = common_word_points(pair.to, vocabulary(), all_words(), kAll);
  REQUIRE(sent.points.size() == 150);
  const std::size_t agreeing = agreeing_word_points(pair.from, vocabulary(), sent, {});
  // 99 % of the right pairs are inliers by the noise, and a few wrong ones are by chance.
  CHECK(agreeing >= common * 9 / 10);
  CHECK(agreeing <= common + 8);
  CHECK(may_show_one_place(pair.from, vocabulary(), sent, {}) == (common > 0));
}

TEST_CASE("Only points with depth whose words the other keyframe has are sent") {
  std::mt19937 rng(4);
  KeyframePair pair = two_views(rng, 150);
  pair.to.keypoints[7].inverse_depth = 0.0F;
  for (std::uint32_t i = 20; i < 20 + kMaxWordRepeats + 1; ++i)
    pair.to.descriptors[i] = toy_descriptor(160);
  for (std::uint32_t i = 30; i < 30 + kMaxWordRepeats; ++i)
    pair.to.descriptors[i] = toy_descriptor(170);
  const std::vector<std::uint32_t> theirs = {3, 7, 9, 160, 170};
  std::vector<std::uint32_t> words;
  for (const WordPoint& point : common_word_points(pair.to, vocabulary(), theirs, kAll).points)
    words.push_back(point.word);
  CHECK(words == std::vector<std::uint32_t>{3, 9, 170, 170, 170, 170});
  CHECK(common_word_places(pair.to, vocabulary(), theirs, kAll) ==
        std::vector<std::size_t>{3, 9, 30, 31, 32, 33});
  CHECK(common_word_places(pair.to, vocabulary(), theirs, 4) ==
        std::vector<std::size_t>{3, 9, 30, 31});
  CHECK(common_word_places(pair.to, vocabulary(), theirs, 0).empty());
}

TEST_CASE("No points, and points that no keypoint can pair with, agree with nothing") {
  std::mt19937 rng(5);
  const KeyframePair pair = two_views(rng, 150);
  WordPoints points = common_word_points(pair.to, vocabulary(), all_words(), kAll);
  for (WordPoint& point : points.points) point.word = 4'000'000'000;
  CHECK(agreeing_word_points(pair.from, vocabulary(), points, {}) == 0);
  points.points.clear();
  CHECK(agreeing_word_points(pair.from, vocabulary(), points, {}) == 0);
  CHECK_FALSE(may_show_one_place(pair.from, vocabulary(), points, {}));
}

TEST_CASE("Both bounds must be reached") {
  std::mt19937 rng(6);
  const KeyframePair pair = two_views(rng, 60);
  WordPoints sent = common_word_points(pair.to, vocabulary(), all_words(), kAll);
  LoopClosureConfig config;
  const auto agreeing = agreeing_word_points(pair.from, vocabulary(), sent, config);
  const auto may = [&] { return may_show_one_place(pair.from, vocabulary(), sent, config); };
  config.min_word_points = static_cast<int>(agreeing);
  CHECK(may());
  ++config.min_word_points;
  CHECK_FALSE(may());
  config.min_word_points = 1;
  const WordPoint lonely{sent.points[0].keypoint, 4'000'000'000};
  sent.points.resize(static_cast<std::size_t>(static_cast<double>(agreeing) / kMinWordShare),
                     lonely);
  CHECK(may());
  sent.points.push_back(lonely);
  CHECK_FALSE(may());
}

using Words = std::vector<std::uint32_t>;

TEST_CASE("Words of peers are kept by keyframe, the newest of each") {
  PeerWords words;
  words.put({7, 1}, {1, 2});
  words.put({8, 1}, {3});
  words.put({7, 1}, {5, 6, 7});
  REQUIRE(words.find({7, 1}) != nullptr);
  CHECK(*words.find({7, 1}) == Words{5, 6, 7});
  CHECK(*words.find({8, 1}) == Words{3});
  CHECK(words.find({7, 2}) == nullptr);
  CHECK(words.find({9, 1}) == nullptr);
}

TEST_CASE("A peer that sends words without end loses its own oldest") {
  const std::size_t size = GENERATE(0U, 1000U, 65536U);
  PeerWords words;
  words.put({8, 0}, {1});
  // Twice the words that are kept, most of them added twice.
  const auto count = static_cast<KeyframeIndex>(2 * PeerWords::kMaxWordsPerRobot / (size + 32));
  for (KeyframeIndex i = 0; i < count; ++i)
    for (int k = 0; k < 2; ++k) words.put({7, i}, Words(size, i));
  KeyframeIndex kept = 0;
  for (KeyframeIndex i = 0; i < count; ++i) kept += words.find({7, i}) != nullptr ? 1 : 0;
  CHECK(kept * (size + 32) <= PeerWords::kMaxWordsPerRobot);
  CHECK((kept + 1) * (size + 32) > PeerWords::kMaxWordsPerRobot);
  CHECK(words.find({7, count - 1}) != nullptr);
  CHECK(words.find({7, 0}) == nullptr);
  CHECK(words.find({8, 0}) != nullptr);
}

}  // namespace
}  // namespace km
