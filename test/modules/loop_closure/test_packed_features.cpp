#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "modules/loop_closure/matching.hpp"
#include "modules/loop_closure/packed_features.hpp"
#include "test/modules/loop_closure/synthetic_keyframes.hpp"

namespace km {
namespace {

KeyframeFeatures random_features(unsigned seed, int points) {
  std::mt19937 rng(seed);
  KeyframeFeatures features = make_keyframe_pair(rng, points, {0.7, 0.3}, 1.0).to;
  features.matched = orb_bits(features.descriptors);
  for (std::size_t i = 0; i < features.keypoints.size(); ++i) {
    features.keypoints[i].octave = static_cast<std::uint8_t>(i % 8);
    if (i % 4 == 0) features.keypoints[i].inverse_depth = 0.0F;
  }
  return features;
}

TEST_CASE("Features are packed in 17 bytes a keypoint, rounded by less than their noise",
          "[packed_features]") {
  KeyframeFeatures sent = random_features(GENERATE(1U, 2U), 500);
  sent.keypoints[1].inverse_depth = 1e-9F;
  const std::vector<std::uint8_t> bytes = pack(sent);
  CHECK(bytes.size() < 17 * sent.keypoints.size());
  const auto received = unpack_features(bytes);
  REQUIRE(received);
  CHECK(received->focal_px == kFocal_px);
  CHECK(received->baseline_m == Approx(kBaseline_m));
  REQUIRE(received->keypoints.size() == sent.keypoints.size());
  CHECK(received->matched == sent.matched);
  for (std::size_t i = 0; i < sent.keypoints.size(); ++i) {
    const Keypoint &p = sent.keypoints[i], &q = received->keypoints[i];
    CHECK(q.octave == p.octave);
    CHECK(q.has_depth() == p.has_depth());
    CHECK(kFocal_px * static_cast<double>((p.bearing - q.bearing).cwiseAbs().maxCoeff()) < 0.2);
    CHECK(kFocal_px * kBaseline_m *
              static_cast<double>(std::abs(p.inverse_depth - q.inverse_depth)) <
          0.05);
  }
  CHECK(pack(*received) == bytes);
}

TEST_CASE("Features without keypoints need no camera and no bytes", "[packed_features]") {
  CHECK(pack(KeyframeFeatures()).empty());
  const auto received = unpack_features({});
  REQUIRE(received);
  CHECK(received->keypoints.empty());
}

TEST_CASE("Features that end early or late, or state what no camera has, are refused",
          "[packed_features]") {
  const KeyframeFeatures features = random_features(4, 12);
  std::vector<std::uint8_t> bytes = pack(features);
  for (std::size_t size = 1; size < bytes.size(); ++size)
    CHECK_FALSE(unpack_features(std::span(bytes).first(size)));
  bytes.push_back(0);
  CHECK_FALSE(unpack_features(bytes));

  for (const double wrong : {std::nan(""), -1.0, std::numeric_limits<double>::infinity()}) {
    KeyframeFeatures hostile = features;
    hostile.focal_px = wrong;
    CHECK_FALSE(unpack_features(pack(hostile)));
    hostile = features;
    hostile.baseline_m = wrong;
    CHECK_FALSE(unpack_features(pack(hostile)));
  }
  KeyframeFeatures aside = features;
  aside.keypoints[0].bearing.y() = -101.0F;
  CHECK_FALSE(unpack_features(pack(aside)));
  KeyframeFeatures near = features;
  near.keypoints[0].inverse_depth = 1e5F;
  CHECK_FALSE(unpack_features(pack(near)));
  KeyframeFeatures many = features;
  many.keypoints.assign(kMaxKeypoints + 1, features.keypoints[0]);
  many.matched.resize(many.keypoints.size());
  CHECK_FALSE(unpack_features(pack(many)));
}

TEST_CASE("Descriptors are packed as they are", "[packed_features]") {
  const std::vector<MatchedDescriptor> sent = random_features(5, 12).matched;
  std::vector<std::uint8_t> bytes = pack(sent);
  CHECK(bytes.size() == sent.size() * kMatchedBytes);
  const auto received = unpack_descriptors(bytes);
  CHECK(received == sent);
  CHECK(unpack_descriptors({}) == std::vector<MatchedDescriptor>{});
  bytes.push_back(0);
  CHECK_FALSE(unpack_descriptors(bytes));
  CHECK_FALSE(unpack_descriptors(std::vector<std::uint8_t>(kMatchedBytes * (kMaxKeypoints + 1))));
}

}  // namespace
}  // namespace km
