#include "modules/loop_closure/matching.hpp"
#include "modules/loop_closure/packed_keypoints.hpp"
#include "test/modules/loop_closure/synthetic_keyframes.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

KeyframeFeatures random_features(unsigned seed, int points) {
  std::mt19937 rng(seed);
  KeyframeFeatures features = make_keyframe_pair(rng, points, {}, 1.0).to;
  features.matched = orb_bits(features.descriptors);
  for (std::size_t i = 0; i < features.keypoints.size(); ++i) {
    features.keypoints[i].octave = static_cast<std::uint8_t>(i % 8);
    if (i % 4 == 0) features.keypoints[i].inverse_depth = 0.0F;
  }
  features.keypoints[1].inverse_depth = 1e-9F;
  return features;
}

// Those of `features` with a depth; the words ascend, and some are equal.
WordPoints points_of(const KeyframeFeatures& features) {
  WordPoints result{features.focal_px, features.baseline_m, {}};
  for (std::uint32_t i = 0; i < features.keypoints.size(); ++i)
    if (features.keypoints[i].has_depth())
      result.points.push_back({features.keypoints[i], 40 * (i / 5)});
  return result;
}

void check_near(const Keypoint& sent, const Keypoint& received) {
  CHECK(received.octave == sent.octave);
  CHECK(received.has_depth() == sent.has_depth());
  CHECK(kFocal_px * static_cast<double>((sent.bearing - received.bearing).cwiseAbs().maxCoeff()) <
        0.2);
  CHECK(kFocal_px * kBaseline_m *
            static_cast<double>(std::abs(sent.inverse_depth - received.inverse_depth)) <
        0.05);
}

TEST_CASE("Features are packed in 17 bytes a keypoint, rounded by less than their noise") {
  const KeyframeFeatures sent = random_features(GENERATE(1U, 2U), 500);
  const std::vector<std::uint8_t> bytes = pack(sent);
  CHECK(bytes.size() < 17 * sent.keypoints.size());
  const auto received = unpack_features(bytes);
  REQUIRE(received);
  CHECK(received->focal_px == kFocal_px);
  CHECK(received->baseline_m == Approx(kBaseline_m));
  REQUIRE(received->keypoints.size() == sent.keypoints.size());
  CHECK(received->matched == sent.matched);
  for (std::size_t i = 0; i < sent.keypoints.size(); ++i)
    check_near(sent.keypoints[i], received->keypoints[i]);
  CHECK(pack(*received) == bytes);
  CHECK(pack(KeyframeFeatures()).empty());
  REQUIRE(unpack_features({}));
  CHECK(unpack_features({})->keypoints.empty());
}

TEST_CASE("Word points are packed in 6 bytes each, rounded by less than their noise") {
  const WordPoints sent = points_of(random_features(3, 500));
  const std::vector<std::uint8_t> bytes = pack(sent);
  CHECK(bytes.size() < 6 * sent.points.size() + 20);
  const auto received = unpack_word_points(bytes);
  REQUIRE(received);
  CHECK(received->focal_px == kFocal_px);
  CHECK(received->baseline_m == Approx(kBaseline_m));
  REQUIRE(received->points.size() == sent.points.size());
  for (std::size_t i = 0; i < sent.points.size(); ++i) {
    CHECK(received->points[i].word == sent.points[i].word);
    check_near(sent.points[i].keypoint, received->points[i].keypoint);
  }
  const auto nothing = unpack_word_points(pack(WordPoints{kFocal_px, kBaseline_m, {}}));
  REQUIRE(nothing);
  CHECK(nothing->points.empty());
}

TEST_CASE("Keypoints that end early or late, or state what no camera has, are refused") {
  const KeyframeFeatures features = random_features(4, 12);
  const WordPoints points = points_of(features);
  for (const bool of_words : {false, true}) {
    const auto is_refused = [&](std::span<const std::uint8_t> bytes) {
      return of_words ? !unpack_word_points(bytes) : !unpack_features(bytes);
    };
    std::vector<std::uint8_t> bytes = of_words ? pack(points) : pack(features);
    for (std::size_t size = 1; size < bytes.size(); ++size)
      CHECK(is_refused(std::span(bytes).first(size)));
    bytes.push_back(0);
    CHECK(is_refused(bytes));
  }
  const auto check_refused = [&](const auto& change) {
    KeyframeFeatures hostile = features;
    change(hostile);
    CHECK_FALSE(unpack_features(pack(hostile)));
    CHECK_FALSE(unpack_word_points(pack(points_of(hostile))));
  };
  for (const double wrong : {std::nan(""), -1.0, std::numeric_limits<double>::infinity()}) {
    check_refused([&](KeyframeFeatures& hostile) { hostile.focal_px = wrong; });
    check_refused([&](KeyframeFeatures& hostile) { hostile.baseline_m = wrong; });
  }
  check_refused([](KeyframeFeatures& hostile) { hostile.keypoints[2].bearing.y() = -101.0F; });
  check_refused([](KeyframeFeatures& hostile) { hostile.keypoints[2].inverse_depth = 1e5F; });
  check_refused([](KeyframeFeatures& hostile) {
    hostile.keypoints.assign(kMaxKeypoints + 1, hostile.keypoints[2]);
    hostile.matched.resize(hostile.keypoints.size());
  });
}

TEST_CASE("Descriptors are packed as they are") {
  const std::vector<MatchedDescriptor> sent = random_features(5, 12).matched;
  std::vector<std::uint8_t> bytes = pack(sent);
  CHECK(bytes.size() == sent.size() * kMatchedBytes);
  CHECK(unpack_descriptors(bytes) == sent);
  CHECK(unpack_descriptors({}) == std::vector<MatchedDescriptor>{});
  bytes.push_back(0);
  CHECK_FALSE(unpack_descriptors(bytes));
  CHECK_FALSE(unpack_descriptors(std::vector<std::uint8_t>(kMatchedBytes * (kMaxKeypoints + 1))));
}

}  // namespace
}  // namespace km
