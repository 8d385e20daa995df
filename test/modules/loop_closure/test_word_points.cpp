#include <algorithm>
#include <catch2/catch.hpp>
#include <limits>
#include <set>
#include <vector>

#include "modules/loop_closure/packed_word_points.hpp"
#include "modules/loop_closure/word_points.hpp"
#include "test/modules/loop_closure/synthetic_keyframes.hpp"
#include "test/modules/place_recognition/toy_vocabulary.hpp"

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

TEST_CASE("Points of common words agree where the keyframes see one place", "[word_points]") {
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

TEST_CASE("Only points with depth whose words the other keyframe has are sent", "[word_points]") {
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

TEST_CASE("No points, and points that no keypoint can pair with, agree with nothing",
          "[word_points]") {
  std::mt19937 rng(5);
  const KeyframePair pair = two_views(rng, 150);
  WordPoints points = common_word_points(pair.to, vocabulary(), all_words(), kAll);
  for (WordPoint& point : points.points) point.word = 4'000'000'000;
  CHECK(agreeing_word_points(pair.from, vocabulary(), points, {}) == 0);
  points.points.clear();
  CHECK(agreeing_word_points(pair.from, vocabulary(), points, {}) == 0);
  CHECK_FALSE(may_show_one_place(pair.from, vocabulary(), points, {}));
}

TEST_CASE("Both bounds must be reached", "[word_points]") {
  std::mt19937 rng(6);
  const KeyframePair pair = two_views(rng, 60);
  const WordPoints sent = common_word_points(pair.to, vocabulary(), all_words(), kAll);
  LoopClosureConfig config;
  const auto agreeing = agreeing_word_points(pair.from, vocabulary(), sent, config);
  const auto may = [&] { return may_show_one_place(pair.from, vocabulary(), sent, config); };
  config.min_word_share = 0.0;
  config.min_word_points = static_cast<int>(agreeing);
  CHECK(may());
  ++config.min_word_points;
  CHECK_FALSE(may());
  config.min_word_points = 1;
  config.min_word_share = static_cast<double>(agreeing) / 150.0;
  CHECK(may());
  config.min_word_share += 0.01;
  CHECK_FALSE(may());
}

TEST_CASE("Packed points are rounded by less than a fifth of a pixel", "[word_points]") {
  std::mt19937 rng(7);
  KeyframePair pair = two_views(rng, 150);
  for (std::size_t i = 0; i < 150; ++i)
    pair.to.keypoints[i].octave = static_cast<std::uint8_t>(i % 8);
  pair.to.keypoints[0].inverse_depth = 1e-9F;
  const WordPoints sent = common_word_points(pair.to, vocabulary(), all_words(), kAll);
  const std::vector<std::uint8_t> bytes = pack(sent);
  CHECK(bytes.size() < 6 * sent.points.size());
  const auto received = unpack_word_points(bytes);
  REQUIRE(received);
  CHECK(received->focal_px == kFocal_px);
  CHECK(received->baseline_m == Approx(kBaseline_m));
  REQUIRE(received->points.size() == sent.points.size());
  for (std::size_t i = 0; i < sent.points.size(); ++i) {
    const Keypoint &p = sent.points[i].keypoint, &q = received->points[i].keypoint;
    CHECK(received->points[i].word == sent.points[i].word);
    CHECK(q.octave == p.octave);
    CHECK(kFocal_px * static_cast<double>((p.bearing - q.bearing).cwiseAbs().maxCoeff()) < 0.2);
    CHECK(kFocal_px * kBaseline_m *
              static_cast<double>(std::abs(p.inverse_depth - q.inverse_depth)) <
          0.05);
    CHECK(q.has_depth());
  }
  WordPoints none = sent;
  none.points.clear();
  const auto nothing = unpack_word_points(pack(none));
  REQUIRE(nothing);
  CHECK(nothing->points.empty());
}

TEST_CASE("Bytes that end early or late, or state what no camera has, are refused",
          "[word_points]") {
  std::mt19937 rng(8);
  const KeyframePair pair = two_views(rng, 150);
  const WordPoints points =
      common_word_points(pair.to, vocabulary(), std::vector<std::uint32_t>{3, 9, 27}, kAll);
  std::vector<std::uint8_t> bytes = pack(points);
  for (std::size_t size = 0; size < bytes.size(); ++size)
    CHECK_FALSE(unpack_word_points(std::span(bytes).first(size)));
  bytes.push_back(0);
  CHECK_FALSE(unpack_word_points(bytes));

  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (const float wrong : {nan, -1.0F, std::numeric_limits<float>::infinity()}) {
    WordPoints hostile = points;
    hostile.focal_px = static_cast<double>(wrong);
    CHECK_FALSE(unpack_word_points(pack(hostile)));
    hostile = points;
    hostile.baseline_m = static_cast<double>(wrong);
    CHECK_FALSE(unpack_word_points(pack(hostile)));
  }
  WordPoints near = points;
  near.points[0].keypoint.inverse_depth = 1e5F;
  CHECK_FALSE(unpack_word_points(pack(near)));
  WordPoints many = points;
  many.points.assign(kMaxWordPoints + 1, points.points[0]);
  CHECK_FALSE(unpack_word_points(pack(many)));
  many.points.pop_back();
  CHECK(unpack_word_points(pack(many)));
}

}  // namespace
}  // namespace km
