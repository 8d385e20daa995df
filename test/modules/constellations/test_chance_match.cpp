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

}  // namespace km
