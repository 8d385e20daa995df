#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <set>
#include <string>
#include <vector>

#include "apps/lab/simulation/world/canvas.hpp"
#include "apps/lab/simulation/world/procedural_texture.hpp"

namespace km {
namespace {

/// Luminance of the texels of one level, row by row.
std::vector<float> texels(const Texture& texture, int level) {
  const int n = texture.size() >> level;
  std::vector<float> values;
  for (int y = 0; y < n; ++y) {
    for (int x = 0; x < n; ++x) {
      const Eigen::Vector2f uv(static_cast<float>(x) + 0.5F, static_cast<float>(y) + 0.5F);
      const Eigen::Vector3f color =
          texture.color(uv / static_cast<float>(n), 1.0F / static_cast<float>(n));
      values.push_back(color.dot(Eigen::Vector3f(0.2126F, 0.7152F, 0.0722F)));
    }
  }
  return values;
}

struct Moments {
  double mean = 0.0;
  double variance = 0.0;
};

Moments moments(const std::vector<float>& values) {
  Moments result;
  for (const float value : values) result.mean += value;
  result.mean /= static_cast<double>(values.size());
  for (const float value : values) result.variance += (value - result.mean) * (value - result.mean);
  result.variance /= static_cast<double>(values.size());
  return result;
}

/// Mean absolute difference between each column (or row) and the next, the last one to the first.
std::vector<double> steps(const std::vector<float>& values, int n, bool along_rows) {
  std::vector<double> result;
  for (int i = 0; i < n; ++i) {
    double sum = 0.0;
    for (int j = 0; j < n; ++j) {
      const auto at = [&](int k) {
        return static_cast<double>(
            values[static_cast<std::size_t>(along_rows ? j * n + k : k * n + j)]);
      };
      sum += std::abs(at((i + 1) % n) - at(i));
    }
    result.push_back(sum / n);
  }
  return result;
}

}  // namespace

TEST_CASE("Every recipe has traits of its own number", "[simulation][texture]") {
  std::set<std::string> names;
  for (int i = 0; i < kRecipeCount; ++i) {
    const RecipeTraits& traits = traits_of(static_cast<Recipe>(i));
    CAPTURE(i, traits.name);
    CHECK(traits.recipe == static_cast<Recipe>(i));
    CHECK(names.insert(traits.name).second);
    CHECK(traits.period_m > 0.0F);
    CHECK(traits.detail >= Recipe::kDetailFlat);
  }
  CHECK_THROWS_AS(traits_of(static_cast<Recipe>(kRecipeCount)), std::invalid_argument);
}

TEST_CASE(
    "A recipe's tile is its seed's own, has no seam, and the mean and contrast of the material",
    "[simulation][texture]") {
  const auto recipe = static_cast<Recipe>(GENERATE(range(0, kRecipeCount)));
  CAPTURE(traits_of(recipe).name);
  const Texture texture = make_texture(recipe, 3);
  REQUIRE(texture.size() == traits_of(recipe).size);
  const std::vector<float> values = texels(texture, 0);
  const Moments all = moments(values);
  const double contrast = std::sqrt(all.variance) / all.mean;
  const bool fixed = recipe == Recipe::kChecker || recipe == Recipe::kDetailFlat;
  CHECK((texels(make_texture(recipe, 4), 1) == texels(texture, 1)) == fixed);
  if (recipe == Recipe::kDetailFlat) {
    CHECK(all.mean == Approx(0.5));
    return;
  }
  for (const bool along_rows : {true, false}) {
    CAPTURE(along_rows);
    std::vector<double> step = steps(values, texture.size(), along_rows);
    const double seam = step.back();
    step.pop_back();
    CHECK(seam <= 1.05 * *std::max_element(step.begin(), step.end()));
  }
  CHECK(contrast > 0.01);
  if (recipe == Recipe::kMarkerTape) {  // white on black
    CHECK(all.mean == Approx(0.1).margin(0.05));
  } else if (recipe > Recipe::kDetailFlat) {
    CHECK(all.mean == Approx(0.5).margin(0.005));  // scaled by two it changes no mean
    CHECK(contrast < 0.15);
  } else {
    CHECK(all.mean > 0.05);
    CHECK(all.mean < 0.9);
    CHECK(contrast < 1.0);
  }
}

TEST_CASE("Materials of nature have structure at every scale", "[simulation][texture]") {
  const Recipe recipe =
      GENERATE(Recipe::kAsphalt, Recipe::kConcrete, Recipe::kPlaster, Recipe::kGrass, Recipe::kSoil,
               Recipe::kGravel, Recipe::kBark, Recipe::kLeaves, Recipe::kCanvas,
               Recipe::kWoodPlanks, Recipe::kDetailGrain, Recipe::kDetailStains);
  CAPTURE(traits_of(recipe).name);
  const Texture texture = make_texture(recipe, 4);
  Moments fine = moments(texels(texture, 0));
  for (int level = 1; texture.size() >> level >= 4; ++level) {
    CAPTURE(level);
    const Moments coarse = moments(texels(texture, level));
    // The difference between averages over an edge and over twice the edge is the power of one
    // octave.
    const double power = fine.variance - coarse.variance;
    CHECK(std::sqrt(std::max(power, 0.0)) > 0.004 * fine.mean);
    fine = coarse;
  }
}

TEST_CASE("Fractal noise has mean 0, deviation 1 and the configured octaves",
          "[simulation][texture]") {
  constexpr int kSize = 128;
  const auto seed = GENERATE(range(1U, 5U));
  CAPTURE(seed);
  SeededRandom random(seed);
  const NoiseField noise = fractal_noise(kSize, {.gain = 1.0F}, random);
  const Moments all = moments(noise.values());
  CHECK(all.mean == Approx(0.0).margin(1e-5));
  CHECK(all.variance == Approx(1.0).margin(1e-4));
  CHECK(noise(-1, -1) == noise(kSize - 1, kSize - 1));
  CHECK(noise(kSize, 2 * kSize) == noise(0, 0));

  const NoiseField smooth = fractal_noise(kSize, {.gain = 1.0F, .finest = 4}, random);
  const auto roughness = [](const NoiseField& field) {
    const std::vector<double> step = steps(field.values(), kSize, true);
    return step[kSize / 2];
  };
  CHECK(roughness(noise) > 4.0 * roughness(smooth));
}

}  // namespace km
