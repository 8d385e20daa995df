#include <catch2/catch.hpp>

#include <map>
#include <random>
#include <vector>

#include "modules/constellations/chance_match.hpp"
#include "modules/constellations/constellation_match.hpp"
#include "test/modules/constellations/scenes.hpp"

namespace km {

TEST_CASE("Random places match by chance no more often than expected", "[constellations][slow]") {
  // For each pair of places the best match with any evidence. By Markov's inequality, at most a
  // share E of them has an expected number below E.
  constexpr int kPairs = 1000;
  const bool has_rows = GENERATE(false, true);
  std::mt19937 rng(12);
  const auto scene = [&] { return has_rows ? rows(15, rng) : square(15, rng); };
  std::map<int, int> below;  // number of pairs with log10 E below the key
  ConstellationOptions options;
  options.max_chance = 1e-9;  // no second search
  for (int n = 0; n < kPairs; ++n) {
    const auto a = map_of(scene(), random_upright(rng), {}, rng);
    const auto b = map_of(scene(), random_upright(rng), {}, rng);
    const ConstellationMatch match = match_constellations(a, b, options);
    if (match.pairs.empty()) continue;
    for (int key = -4; key <= 0; ++key) below[key] += match.log10_chance < key ? 1 : 0;
  }
  for (const auto& [key, count] : below) {
    CAPTURE(has_rows, key, count);
    const double expected = std::pow(10.0, key) * kPairs;
    CHECK(count <= expected + 3.0 * std::sqrt(expected) + 0.5);
  }
}

TEST_CASE("More pairs and smaller errors are less likely by chance", "[constellations]") {
  std::mt19937 rng(13);
  const auto scene = square(18, rng);
  const auto a = map_of(scene, SE3::Identity(), {.sigma_m = 0.02}, rng);
  const ChanceMatch chance(a, a);
  std::vector<LandmarkPair> pairs;
  double last = 100.0;
  for (std::size_t n = 0; n < a.size(); ++n) {
    pairs.push_back({a[n], a[n]});
    if (pairs.size() < 3) {
      CHECK(chance.log10_expected(pairs) > 1e6);
      continue;
    }
    if (pairs.size() % 3 != 0) continue;
    CHECK(chance.log10_expected(pairs) < last);
    last = chance.log10_expected(pairs);
  }
  auto noisy = pairs;
  noisy[4].a.center.x() += 0.4;
  CHECK(chance.log10_expected(noisy) > last);
  noisy[4].a.center.x() += 40.0;
  CHECK(chance.log10_expected(noisy) > 1e6);
}

}  // namespace km
