#include <catch2/catch.hpp>
#include <vector>

#include "modules/simulation/world/procedural_texture.hpp"
#include "modules/simulation/world/seeded_random.hpp"
#include "modules/simulation/world/world.hpp"

namespace km {

TEST_CASE("Texture lookups", "[!benchmark]") {
  const Texture texture = make_texture(Recipe::kAsphalt, 1);
  // Like an image: neighbours lie one footprint apart, rows anywhere.
  constexpr int kRows = 1000;
  constexpr int kColumns = 1000;
  SeededRandom random(1);
  std::vector<Eigen::Vector2f> starts;
  std::vector<float> footprints;
  for (int i = 0; i < kRows; ++i) {
    const float u = random.uniform(-50.0F, 50.0F);
    starts.emplace_back(u, random.uniform(-50.0F, 50.0F));
    footprints.push_back(random.uniform(0.0005F, 0.01F));
  }
  const auto sum_of = [&](const auto& lookup) {
    float sum = 0.0F;
    for (std::size_t row = 0; row < starts.size(); ++row) {
      Eigen::Vector2f uv = starts[row];
      for (int i = 0; i < kColumns; ++i, uv.x() += footprints[row]) {
        sum += lookup(uv, footprints[row]);
      }
    }
    return sum;
  };
  BENCHMARK("luminance, n=1000000") {
    return sum_of([&](const auto& uv, float width) { return texture.luminance(uv, width); });
  };
  BENCHMARK("color, n=1000000") {
    return sum_of([&](const auto& uv, float width) { return texture.color(uv, width).sum(); });
  };
}

TEST_CASE("Making worlds of textures", "[!benchmark]") {
  BENCHMARK("all recipes") {
    std::vector<Texture> textures;
    for (int i = 0; i < kRecipeCount; ++i) {
      textures.push_back(make_texture(static_cast<Recipe>(i), 1));
    }
    return textures;
  };
  BENCHMARK("the Vicon room") {
    return make_vicon_room(1);
  };
}

}  // namespace km
