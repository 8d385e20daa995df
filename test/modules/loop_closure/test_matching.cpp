#include <algorithm>
#include <bit>
#include <catch2/catch.hpp>

#include "modules/loop_closure/matching.hpp"
#include "test/modules/loop_closure/synthetic_keyframes.hpp"

namespace km {
namespace {

int bits_apart(const BinaryDescriptor& a, const BinaryDescriptor& b) {
  int bits = 0;
  for (std::size_t i = 0; i < kMatchedBytes; ++i)
    bits += std::popcount(static_cast<unsigned>(a[i] ^ b[i]));
  return bits;
}

// A copy of `descriptor` with about `flips` bits changed.
BinaryDescriptor altered(BinaryDescriptor descriptor, int flips, std::mt19937& rng) {
  std::uniform_int_distribution<std::size_t> bit(0, 255);
  for (int i = 0; i < flips; ++i) {
    const std::size_t k = bit(rng);
    descriptor[k / 8] = static_cast<std::uint8_t>(descriptor[k / 8] ^ (1U << (k % 8)));
  }
  return descriptor;
}

std::vector<Match> by_definition(const std::vector<BinaryDescriptor>& a,
                                 const std::vector<BinaryDescriptor>& b, const MatchRules& rules) {
  const auto nearest = [](const BinaryDescriptor& to, const std::vector<BinaryDescriptor>& among) {
    std::size_t best = 0;
    for (std::size_t i = 1; i < among.size(); ++i)
      if (bits_apart(to, among[i]) < bits_apart(to, among[best])) best = i;
    return best;
  };
  std::vector<Match> matches;
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::vector<int> distances;
    for (const BinaryDescriptor& d : b) distances.push_back(bits_apart(a[i], d));
    const std::size_t j = nearest(a[i], b);
    std::sort(distances.begin(), distances.end());
    if (distances[0] > rules.max_distance || distances[0] >= rules.max_ratio * distances[1] ||
        nearest(b[j], a) != i)
      continue;
    matches.push_back({static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(j), distances[0]});
  }
  return matches;
}

TEST_CASE("matching agrees with its definition", "[matching]") {
  const auto seed = GENERATE(range(1U, 11U));
  CAPTURE(seed);
  std::mt19937 rng(seed);
  std::vector<BinaryDescriptor> a, b;
  for (int i = 0; i < 60; ++i) a.push_back(random_descriptor(rng));
  for (int i = 0; i < 90; ++i)  // near copies of a, some of them twice
    b.push_back(altered(a[static_cast<std::size_t>(i * 7 % 60)], i, rng));
  const MatchRules rules{0.88, 24};
  const std::vector<Match> matches = match_descriptors(a, b, rules);
  CHECK(matches == by_definition(a, b, rules));
  CHECK_FALSE(matches.empty());
}

TEST_CASE("a frame matched to itself pairs every descriptor with itself", "[matching]") {
  std::mt19937 rng(1);
  std::vector<BinaryDescriptor> a;
  for (int i = 0; i < 200; ++i) a.push_back(random_descriptor(rng));
  const std::vector<Match> matches = match_descriptors(a, a, {});
  REQUIRE(matches.size() == a.size());
  for (std::uint32_t i = 0; i < matches.size(); ++i) CHECK(matches[i] == Match{i, i, 0});
}

TEST_CASE("descriptors match by their first 96 bits", "[matching]") {
  std::mt19937 rng(2);
  std::vector<BinaryDescriptor> a, b;
  for (int i = 0; i < 50; ++i) a.push_back(random_descriptor(rng));
  b = a;
  for (BinaryDescriptor& descriptor : b)
    for (std::size_t i = kMatchedBytes; i < descriptor.size(); ++i) descriptor[i] = 0;
  CHECK(match_descriptors(a, b, {}) == match_descriptors(a, a, {}));
  for (BinaryDescriptor& descriptor : b)  // 25 other bits
    for (std::size_t i = 0; i < 25; ++i)
      descriptor[i / 8] = static_cast<std::uint8_t>(descriptor[i / 8] ^ (1U << (i % 8)));
  CHECK(match_descriptors(a, b, {}).empty());
}

TEST_CASE("without a second descriptor there is no ratio and no match", "[matching]") {
  const std::vector<BinaryDescriptor> none, one(1),
      two = {BinaryDescriptor{}, BinaryDescriptor{255}};
  CHECK(match_descriptors(two, none, {}).empty());
  CHECK(match_descriptors(two, one, {}).empty());
  CHECK(match_descriptors(none, two, {}).empty());
  CHECK(match_descriptors(one, two, {}).size() == 1);
}

TEST_CASE("guided matching distinguishes equal descriptors by their place", "[matching]") {
  std::mt19937 rng(4);
  KeyframePair pair = make_keyframe_pair(rng, 50, {}, 0.0);
  // Descriptors alone cannot match: there is only one.
  for (auto* descriptors : {&pair.from.descriptors, &pair.to.descriptors})
    for (BinaryDescriptor& descriptor : *descriptors) descriptor = {};
  REQUIRE(match_descriptors(pair.from.descriptors, pair.to.descriptors, {}).empty());
  // Far enough apart in the image not to compete.
  KeyframePair sparse = pair;
  for (KeyframeFeatures* features : {&sparse.from, &sparse.to}) features->keypoints.clear();
  for (std::size_t i = 0; i < pair.from.keypoints.size(); ++i) {
    const auto near = [&](const Keypoint& k) {
      return (k.bearing - pair.from.keypoints[i].bearing).norm() * kFocal_px < 60.0;
    };
    const auto& kept = sparse.from.keypoints;
    if (std::any_of(kept.begin(), kept.end(), near)) continue;
    sparse.from.keypoints.push_back(pair.from.keypoints[i]);
    sparse.to.keypoints.push_back(pair.to.keypoints[i]);
  }
  const std::size_t count = sparse.from.keypoints.size();
  REQUIRE(count > 10);
  sparse.from.descriptors.resize(count);
  sparse.to.descriptors.resize(count);

  const SE3 T_a_b = pair.from.T_body_cam.inverse() * pair.T_from_to * pair.to.T_body_cam;
  const std::vector<Match> matches = match_guided(T_a_b, sparse.from, sparse.to, {});
  CHECK(matches.size() == count);
  for (const Match& match : matches) CHECK(match.a == match.b);
}

TEST_CASE("guided matching survives keypoints from anywhere", "[matching]") {
  std::mt19937 rng(5);
  KeyframePair pair = make_keyframe_pair(rng, 20, {}, 0.0);
  pair.from.focal_px = pair.to.focal_px = 1e6;
  pair.from.keypoints[0].bearing = {100.0F, -100.0F};
  pair.to.keypoints[1].bearing = {-100.0F, 100.0F};
  CHECK(match_guided(SE3::Identity(), pair.from, pair.to, {}).size() <= 20);
  CHECK(match_guided(SE3::Identity(), {}, pair.to, {}).empty());
}

}  // namespace
}  // namespace km
