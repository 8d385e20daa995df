#include <catch2/catch.hpp>
#include <cmath>
#include <vector>

#include "apps/lab/simulation/world/seeded_random.hpp"
#include "apps/lab/simulation/world/texture.hpp"

namespace km {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

constexpr int kSize = 64;
const Vector3f kRec709{0.2126F, 0.7152F, 0.0722F};

std::vector<Vector3f> random_tile(int size, float brightest, SeededRandom& random) {
  std::vector<Vector3f> rgb(static_cast<std::size_t>(size * size));
  for (Vector3f& texel : rgb)
    for (int channel = 0; channel < 3; ++channel) texel[channel] = random.uniform(0.0F, brightest);
  return rgb;
}

/// Mean over the square of `edge` x `edge` texels whose lower left one is (x, y).
Vector3f area_mean(const std::vector<Vector3f>& rgb, int size, int x, int y, int edge) {
  Vector3f sum = Vector3f::Zero();
  for (int row = y; row < y + edge; ++row)
    for (int column = x; column < x + edge; ++column)
      sum += rgb[static_cast<std::size_t>(row * size + column)];
  return sum / static_cast<float>(edge * edge);
}

/// Luminance of a texel as gray_texels() holds it; checks that its quad holds its neighbours as
/// well.
float stored_gray(const Texture& texture, int level, int x, int y) {
  const Texture::GrayTexels gray = texture.gray_texels();
  std::size_t begin = 0;
  for (int k = 0; k < level; ++k) begin += std::size_t{1} << (2 * (gray.log_size - k));
  const int n = texture.size() >> level;
  const auto quad = [&](int column, int row) {
    return gray.quads[begin + static_cast<std::size_t>(row % n * n + column % n)];
  };
  const auto texel = [&](int column, int row) { return quad(column, row) & 0xFFU; };
  REQUIRE(quad(x, y) ==
          (texel(x, y) | texel(x + 1, y) << 8 | texel(x, y + 1) << 16 | texel(x + 1, y + 1) << 24));
  return gray.scale * static_cast<float>(texel(x, y));
}

Vector2f center_of(int x, int y, int n) {
  return Vector2f(static_cast<float>(x) + 0.5F, static_cast<float>(y) + 0.5F) /
         static_cast<float>(n);
}

}  // namespace

TEST_CASE("A texture refuses odd sizes, missing texels and albedos beyond one",
          "[simulation][texture]") {
  const auto white = [](int texels) {
    return std::vector<Vector3f>(static_cast<std::size_t>(texels), Vector3f::Ones());
  };
  CHECK_THROWS_WITH(Texture(3, white(9)), Catch::Contains("size 3"));
  CHECK_THROWS_WITH(Texture(0, white(0)), Catch::Contains("size 0"));
  CHECK_THROWS_WITH(Texture(8192, white(1)), Catch::Contains("size 8192"));
  CHECK_THROWS_WITH(Texture(4, white(15)), Catch::Contains("15 texels given, 16 needed"));
  std::vector<Vector3f> bad = white(4);
  bad[2].y() = 1.5F;
  CHECK_THROWS_WITH(Texture(2, bad), Catch::Contains("1.5"));
  bad[2].y() = std::nanf("");
  CHECK_THROWS_AS(Texture(2, bad), std::invalid_argument);
  CHECK(Texture(1, white(1)).color({0.3F, -7.0F}, 0.2F).x() == Approx(1.0F));
}

TEST_CASE("Each level of a texture averages squares of the tile", "[simulation][texture]") {
  const auto seed = GENERATE(range(1U, 4U));
  const float brightest = GENERATE(1.0F, 0.02F);  // dark tiles keep their shades
  CAPTURE(seed, brightest);
  SeededRandom random(seed);
  const std::vector<Vector3f> rgb = random_tile(kSize, brightest, random);
  const Texture texture(kSize, rgb);
  REQUIRE(texture.levels() == 7);
  const float step = brightest / 255.0F;  // step of the storage; rounding errors are half of it
  for (int level = 0; level < texture.levels(); ++level) {
    CAPTURE(level);
    const int n = kSize >> level;
    const float footprint = 1.0F / static_cast<float>(n);
    float worst = 0.0F;
    float worst_color = 0.0F;
    double sum = 0.0;
    for (int y = 0; y < n; ++y) {
      for (int x = 0; x < n; ++x) {
        const Vector2f uv = center_of(x, y, n);
        const Vector3f expected = area_mean(rgb, kSize, x << level, y << level, 1 << level);
        const float grey = stored_gray(texture, level, x, y);
        sum += grey;
        worst = std::max(worst, std::abs(grey - expected.dot(kRec709)));
        worst_color =
            std::max(worst_color, (texture.color(uv, footprint) - expected).cwiseAbs().maxCoeff());
      }
    }
    CHECK(worst < 0.51F * step);
    CHECK(worst_color < 0.51F * step);
    const float mean = area_mean(rgb, kSize, 0, 0, kSize).dot(kRec709);
    CHECK(static_cast<float>(sum / (n * n)) == Approx(mean).margin(0.51F * step));
  }
}

TEST_CASE("A lookup blends linearly between texels and between levels", "[simulation][texture]") {
  SeededRandom random(5);
  const Texture texture(kSize, random_tile(kSize, 1.0F, random));
  constexpr float kTolerance = 1e-5F;  // rounding of float arithmetic on values up to 255
  for (int i = 0; i < 200; ++i) {
    const int x = random.below(kSize);
    const int y = random.below(kSize);
    const float share_x = random.uniform(0.0F, 1.0F);
    const float share_y = random.uniform(0.0F, 1.0F);
    const auto texel = [&](int right, int up) {
      return texture.color(center_of(x + right, y + up, kSize), 0.0F);
    };
    const Vector3f low = texel(0, 0) + share_x * (texel(1, 0) - texel(0, 0));
    const Vector3f high = texel(0, 1) + share_x * (texel(1, 1) - texel(0, 1));
    const Vector2f uv = center_of(x, y, kSize) + Vector2f(share_x, share_y) / kSize;
    const auto at = [&](float texels) { return texture.color(uv, texels / kSize); };
    CHECK(std::abs((at(0.0F) - low - share_y * (high - low)).dot(kRec709)) < kTolerance);
    CHECK(std::abs((at(3.0F) - 0.5F * (at(2.0F) + at(4.0F))).dot(kRec709)) < kTolerance);
  }
}

TEST_CASE("A texture repeats on both sides of zero", "[simulation][texture]") {
  SeededRandom random(6);
  const Texture texture(kSize, random_tile(kSize, 1.0F, random));
  for (int i = 0; i < 200; ++i) {
    // Multiples of 2^-12 tiles: the shifted coordinates are exact, and so is the result.
    const Vector2f uv(static_cast<float>(random.below(4096)) / 4096.0F,
                      static_cast<float>(random.below(4096)) / 4096.0F);
    const float footprint = random.uniform(0.0F, 0.5F);
    const Vector2f shift(static_cast<float>(random.below(401) - 200),
                         static_cast<float>(random.below(401) - 200));
    CAPTURE(uv.x(), uv.y(), shift.x(), shift.y(), footprint);
    CHECK(texture.color(uv + shift, footprint) == texture.color(uv, footprint));
  }
}

TEST_CASE("A footprint of more than the tile sees its mean", "[simulation][texture]") {
  SeededRandom random(7);
  const std::vector<Vector3f> rgb = random_tile(kSize, 0.5F, random);
  const Texture texture(kSize, rgb);
  const Vector3f mean = area_mean(rgb, kSize, 0, 0, kSize);
  for (const float footprint : {1.0F, 1.5F, 100.0F, 1e20F}) {
    CAPTURE(footprint);
    const Vector3f error = texture.color({0.1F, 0.7F}, footprint) - mean;
    CHECK(error.cwiseAbs().maxCoeff() < 0.26F / 255.0F);
  }
}

}  // namespace km
