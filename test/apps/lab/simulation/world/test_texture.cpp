#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <vector>

#include "apps/lab/simulation/world/procedural_texture.hpp"

namespace km {
namespace {

/// Luminance of the texels, row by row.
std::vector<float> texels(const Texture& texture) {
  const Texture::GrayTexels gray = texture.gray_texels();
  std::vector<float> values;
  for (std::size_t i = 0; i < std::size_t{1} << (2 * gray.log_size); ++i)
    values.push_back(gray.scale * static_cast<float>(gray.quads[i] & 0xFFU));
  return values;
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

TEST_CASE("A recipe's tile is its seed's own, has structure and no seam", "[simulation][texture]") {
  const auto recipe = static_cast<Recipe>(GENERATE(range(0, kRecipeCount)));
  CAPTURE(traits_of(recipe).name);
  const Texture texture = make_texture(recipe, 3);
  const std::vector<float> values = texels(texture);
  const int size = 1 << texture.gray_texels().log_size;
  REQUIRE(size == traits_of(recipe).size);
  const bool fixed = recipe == Recipe::kChecker || recipe == Recipe::kDetailFlat;
  CHECK((texels(make_texture(recipe, 4)) == values) == fixed);
  if (recipe == Recipe::kDetailFlat) return;
  for (const bool along_rows : {true, false}) {
    CAPTURE(along_rows);
    std::vector<double> step = steps(values, size, along_rows);
    const double seam = step.back();
    step.pop_back();
    const double largest = *std::max_element(step.begin(), step.end());
    CHECK(largest > 1e-4);
    CHECK(seam <= 1.05 * largest);
  }
}

}  // namespace
}  // namespace km
