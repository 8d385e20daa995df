#include <bit>

#include "modules/loop_closure/keyframe_features.hpp"
#include "modules/loop_closure/matching.hpp"
#include "test/modules/loop_closure/synthetic_keyframes.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

// As matching.hpp defines it, where network 0 stands for the tests of ORB.
double distance(const MatchedDescriptor& a, const MatchedDescriptor& b, std::uint16_t network) {
  double sum = 0.0;
  for (std::size_t i = 0; network == 0 && i < kMatchedBytes; ++i)
    sum += std::popcount(static_cast<unsigned>(a[i] ^ b[i]));
  const auto x = numbers_of(a), y = numbers_of(b);
  for (std::size_t i = 0; network != 0 && i < kMatchedNumbers; ++i)
    sum += std::pow(x[i] - y[i], 2) * 96.0 / (4.0 * 24.0 * 3.5 * 3.5);
  return sum;
}

KeyframeFeatures features_of(std::vector<MatchedDescriptor> descriptors, std::uint16_t network) {
  KeyframeFeatures features;
  features.matched = std::move(descriptors);
  features.network = network;
  return features;
}

// A copy of `descriptor` with about `flips` bits changed.
MatchedDescriptor altered(MatchedDescriptor descriptor, int flips, std::mt19937& rng) {
  std::uniform_int_distribution<std::size_t> bit(0, 95);
  for (int i = 0; i < flips; ++i) {
    const std::size_t k = bit(rng);
    descriptor[k / 8] = static_cast<std::uint8_t>(descriptor[k / 8] ^ (1U << (k % 8)));
  }
  return descriptor;
}

std::vector<Match> by_definition(const KeyframeFeatures& a, const KeyframeFeatures& b,
                                 const MatchRules& rules) {
  const auto nearest = [&](const MatchedDescriptor& to, const auto& among) {
    std::size_t best = 0;
    for (std::size_t i = 1; i < among.size(); ++i)
      if (distance(to, among[i], a.network) < distance(to, among[best], a.network)) best = i;
    return best;
  };
  std::vector<Match> matches;
  for (std::size_t i = 0; i < a.matched.size(); ++i) {
    std::vector<double> distances;
    for (const auto& d : b.matched) distances.push_back(distance(a.matched[i], d, a.network));
    const std::size_t j = nearest(a.matched[i], b.matched);
    std::sort(distances.begin(), distances.end());
    if (distances[0] > rules.max_distance || distances[0] >= rules.max_ratio * distances[1] ||
        nearest(b.matched[j], a.matched) != i)
      continue;
    matches.push_back({static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(j), distances[0]});
  }
  return matches;
}

TEST_CASE("matching agrees with its definition") {
  const auto seed = GENERATE(range(1U, 11U));
  const auto network = GENERATE(as<std::uint16_t>(), 0, 7);
  CAPTURE(seed, network);
  std::mt19937 rng(seed);
  std::vector<MatchedDescriptor> a, b;
  for (int i = 0; i < 60; ++i) a.push_back(random_descriptor<MatchedDescriptor>(rng));
  for (int i = 0; i < 90; ++i)  // near copies of a, some of them twice
    b.push_back(altered(a[static_cast<std::size_t>(i * 7 % 60)], i, rng));
  const MatchRules rules{0.88, 24};
  const KeyframeFeatures from = features_of(a, network), to = features_of(b, network);
  const std::vector<Match> matches = match_descriptors(from, to, rules);
  const std::vector<Match> expected = by_definition(from, to, rules);
  REQUIRE(matches.size() == expected.size());
  for (std::size_t i = 0; i < matches.size(); ++i) {
    CHECK(matches[i].a == expected[i].a);
    CHECK(matches[i].b == expected[i].b);
    CHECK(matches[i].distance == Approx(expected[i].distance));
  }
  CHECK_FALSE(matches.empty());
}

TEST_CASE("numbers of a network are rounded to a fourteenth of their range") {
  std::mt19937 rng(6);
  std::normal_distribution<float> normal;
  std::array<float, kMatchedNumbers> numbers{};
  for (float& x : numbers) x = normal(rng);
  double squares = 0.0;
  for (const float x : numbers) squares += static_cast<double>(x * x);
  const double rms = std::sqrt(squares / kMatchedNumbers);
  const auto steps = numbers_of(descriptor_of_numbers(numbers));
  for (std::size_t i = 0; i < kMatchedNumbers; ++i) {
    const double exact = std::clamp(static_cast<double>(numbers[i]) / rms, -2.0, 2.0);
    CHECK(std::abs(steps[i] / kNumberSteps - exact) <= 0.5 / kNumberSteps + 1e-6);
  }
  for (float& x : numbers) x *= 17.0F;  // only the direction counts
  CHECK(numbers_of(descriptor_of_numbers(numbers)) == steps);
  for (const int zero : numbers_of(descriptor_of_numbers(std::array<float, kMatchedNumbers>{})))
    CHECK(zero == 0);
}

TEST_CASE("without a second descriptor there is no ratio and no match") {
  const auto network = GENERATE(as<std::uint16_t>(), 0, 7);
  const auto none = features_of({}, network), one = features_of({{}}, network),
             two = features_of({{}, {255}}, network);
  CHECK(match_descriptors(two, none, {}).empty());
  CHECK(match_descriptors(two, one, {}).empty());
  CHECK(match_descriptors(none, two, {}).empty());
  CHECK(match_descriptors(one, two, {}).size() == 1);
}

TEST_CASE("guided matching distinguishes equal descriptors by their place") {
  std::mt19937 rng(4);
  KeyframePair pair = make_keyframe_pair(rng, 50, {}, 0.0);
  // Keypoints far enough apart in the image not to compete.
  std::vector<std::size_t> apart;
  for (std::size_t i = 0; i < pair.from.keypoints.size(); ++i)
    if (std::ranges::none_of(apart, [&](std::size_t k) {
          const auto offset = pair.from.keypoints[k].bearing - pair.from.keypoints[i].bearing;
          return offset.norm() * kFocal_px < 60.0;
        }))
      apart.push_back(i);
  const std::size_t count = apart.size();
  REQUIRE(count > 10);
  KeyframePair sparse = {.from = selected(pair.from, apart), .to = selected(pair.to, apart)};
  for (auto* descriptors : {&sparse.from.descriptors, &sparse.to.descriptors})
    for (BinaryDescriptor& descriptor : *descriptors) descriptor = {};
  REQUIRE(match_descriptors(sparse.from, sparse.to, {}).empty());

  const SE3 T_a_b = pair.from.T_body_cam.inverse() * pair.T_from_to * pair.to.T_body_cam;
  const std::vector<Match> matches = match_guided(T_a_b, sparse.from, sparse.to, {});
  CHECK(matches.size() == count);
  for (const Match& match : matches) CHECK(match.a == match.b);

  for (KeyframeFeatures* features : {&sparse.from, &sparse.to}) {
    features->matched.resize(count);
    features->network = 7;
  }
  CHECK(match_guided(T_a_b, sparse.from, sparse.to, {}) == matches);
  sparse.to.network = 8;  // compared by ORB
  CHECK(match_guided(T_a_b, sparse.from, sparse.to, {}) == matches);
}

TEST_CASE("guided matching survives keypoints from anywhere") {
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
