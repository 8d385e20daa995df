#include <algorithm>
#include <cmath>

#include "modules/simulation/world/noise_field.hpp"
#include "modules/simulation/world/recipes.hpp"

namespace km::recipes {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

/// Brightness of each cell of a cell noise, drawn uniformly.
std::vector<float> shades(int count, float low, float high, SeededRandom& random) {
  std::vector<float> result(static_cast<std::size_t>(count));
  for (float& shade : result) shade = random.uniform(low, high);
  return result;
}

}  // namespace

Canvas asphalt(int size, SeededRandom& random) {
  const NoiseField wear = fractal_noise(size, {.cells_u = 4, .cells_v = 4, .gain = 0.9F}, random);
  const NoiseField place = fractal_noise(size, {.gain = 0.5F, .finest = 64}, random);
  const CellNoise stones = cell_noise(size, size / 8, random);
  const std::vector<float> stone_shade = shades(size / 8 * (size / 8), 0.55F, 1.7F, random);
  const CellNoise plates = cell_noise(size, 4, random);
  Canvas canvas = Canvas::painted(size, [&](int x, int y) -> Vector3f {
    const auto i = static_cast<std::size_t>(y * size + x);
    float shade = 0.11F * (1.0F + 0.13F * wear(x, y));
    if (stones.nearest.values()[i] < 0.38F) shade *= stone_shade[stones.id[i]];
    // Cracks run between plates, bent by the noise, where the road is worn.
    const auto bent = static_cast<int>(14.0F * place(x, y));
    if (plates.edge(x + bent, y - bent) < 0.012F && place(x + size / 2, y + size / 3) > 0.3F)
      shade *= 0.35F;
    return shade * Vector3f(1.0F, 0.99F, 0.96F);
  });
  for (int i = 0; i < 40; ++i) {  // drops of oil
    const Vector2f at(random.uniform(0.0F, 1.0F), random.uniform(0.0F, 1.0F));
    const float radius = random.uniform(0.001F, 0.006F);
    canvas.ellipse(at, {radius, radius * random.uniform(0.6F, 1.4F)}, 0.0F,
                   Vector3f::Constant(random.uniform(0.04F, 0.07F)));
  }
  return canvas;
}

Canvas concrete(int size, SeededRandom& random) {
  const NoiseField blotches = fractal_noise(size, {.gain = 0.85F}, random);
  const CellNoise pores = cell_noise(size, size / 16, random);
  const std::vector<float> pore_size =
      shades(size / 16 * (size / 16), -0.35F, 0.16F, random);  // most have none
  const std::vector<float> slab_shade = shades(4, 0.92F, 1.06F, random);
  const int half = size / 2;
  return Canvas::painted(size, [&](int x, int y) -> Vector3f {
    const auto i = static_cast<std::size_t>(y * size + x);
    const auto slab = static_cast<std::size_t>(x / half + 2 * (y / half));
    float shade = 0.42F * slab_shade[slab] * (1.0F + 0.085F * blotches(x, y));
    if (pores.nearest.values()[i] < pore_size[pores.id[i]]) shade *= 0.55F;
    const int to_joint = std::min({x % half, y % half});
    if (to_joint < size / 256) shade *= 0.4F;
    return shade * Vector3f(1.0F, 0.98F, 0.94F);
  });
}

Canvas pavers(int size, SeededRandom& random) {
  constexpr int kSlabs = 8;
  const NoiseField grain = fractal_noise(size, {.gain = 0.95F}, random);
  const std::vector<float> slab_shade = shades(kSlabs * kSlabs, 0.78F, 1.14F, random);
  const int slab = size / kSlabs;
  Canvas canvas = Canvas::painted(size, [&](int x, int y) -> Vector3f {
    const auto index = static_cast<std::size_t>(y / slab * kSlabs + x / slab);
    float shade = 0.34F * slab_shade[index] * (1.0F + 0.11F * grain(x, y));
    const int in_x = x % slab;
    const int in_y = y % slab;
    if (in_x == 0 || in_y == 0) shade *= 0.4F;
    if (in_x == 1 || in_y == 1) shade *= 1.12F;  // the lit edge of the slab
    return shade * Vector3f(1.0F, 0.97F, 0.92F);
  });
  for (int i = 0; i < 120; ++i) {  // chewing gum and dirt
    const Vector2f at(random.uniform(0.0F, 1.0F), random.uniform(0.0F, 1.0F));
    const float radius = random.uniform(0.0015F, 0.005F);
    canvas.ellipse(at, {radius, 0.8F * radius}, 0.0F,
                   Vector3f::Constant(random.uniform(0.08F, 0.25F)));
  }
  return canvas;
}

Canvas grass(int size, SeededRandom& random) {
  const NoiseField growth = fractal_noise(size, {.gain = 0.8F}, random);
  const NoiseField fine = fractal_noise(size, {.cells_u = 32, .cells_v = 32, .gain = 1.1F}, random);
  const auto bare = [&](int x, int y) { return smooth_step(0.9F, 1.6F, growth(x, y)); };
  Canvas canvas = Canvas::painted(size, [&](int x, int y) -> Vector3f {
    const float shade = 1.0F + 0.25F * fine(x, y) + 0.12F * growth(x, y);
    const Vector3f green = shade * Vector3f(0.055F, 0.085F, 0.026F);
    const Vector3f earth = (1.0F + 0.2F * fine(x, y)) * Vector3f(0.17F, 0.12F, 0.075F);
    return green + bare(x, y) * (earth - green);
  });
  const auto n = static_cast<float>(size);
  for (int i = 0; i < size * size / 24; ++i) {
    const Vector2f foot(random.uniform(0.0F, 1.0F), random.uniform(0.0F, 1.0F));
    if (random.unit() < bare(static_cast<int>(foot.x() * n), static_cast<int>(foot.y() * n))) {
      continue;
    }
    const float angle = random.uniform(0.0F, 6.2832F);
    const float shade = random.uniform(0.45F, 2.0F);
    const float dry = random.uniform(0.0F, 0.06F);
    const Vector3f color = shade * Vector3f(0.06F + dry, 0.1F + 0.5F * dry, 0.03F);
    const auto length = static_cast<float>(4 + random.below(8));
    for (float t = 0.0F; t < length; t += 0.9F) {
      canvas.texel(static_cast<int>(foot.x() * n + t * std::cos(angle)),
                   static_cast<int>(foot.y() * n + t * std::sin(angle))) = color;
    }
  }
  return canvas;
}

Canvas soil(int size, SeededRandom& random) {
  const NoiseField ground = fractal_noise(size, {.gain = 0.95F}, random);
  const NoiseField slope = relief(fractal_noise(size, {.gain = 0.6F}, random));
  const NoiseField damp = fractal_noise(size, {.gain = 0.6F, .finest = 64}, random);
  Canvas canvas = Canvas::painted(size, [&](int x, int y) -> Vector3f {
    const float wet = smooth_step(0.3F, 1.5F, damp(x, y));
    const float shade = (1.0F + 0.14F * ground(x, y) + 0.16F * slope(x, y)) * (1.0F - 0.4F * wet);
    return shade * Vector3f(0.25F, 0.19F, 0.13F);
  });
  for (int i = 0; i < 900; ++i) {  // stones, each with its shadow
    const Vector2f at(random.uniform(0.0F, 1.0F), random.uniform(0.0F, 1.0F));
    const float radius = 0.0012F + 0.006F * std::pow(random.uniform(0.0F, 1.0F), 4.0F);
    const Vector2f axes(radius, radius * random.uniform(0.6F, 1.0F));
    const float angle = random.uniform(0.0F, 3.1416F);
    canvas.ellipse(at - Vector2f(0.4F * radius, 0.4F * radius), axes, angle,
                   Vector3f(0.09F, 0.07F, 0.05F));
    canvas.ellipse(at, axes, angle, random.uniform(0.2F, 0.5F) * Vector3f(1.0F, 0.95F, 0.88F));
  }
  return canvas;
}

Canvas gravel(int size, SeededRandom& random) {
  const int cells = size / 16;
  const CellNoise pebbles = cell_noise(size, cells, random);
  const CellNoise sand = cell_noise(size, size / 4, random);
  const NoiseField grain = fractal_noise(size, {.gain = 1.0F}, random);
  const std::vector<float> shade_of = shades(cells * cells, 0.18F, 0.6F, random);
  const std::vector<float> sand_shade = shades(size / 4 * (size / 4), 0.1F, 0.4F, random);
  return Canvas::painted(size, [&](int x, int y) -> Vector3f {
    const auto i = static_cast<std::size_t>(y * size + x);
    const bool is_pebble = pebbles.edge.values()[i] > 0.12F && pebbles.nearest.values()[i] < 0.6F;
    // Lit from +u +v: brighter where the pebble's top falls off to that side.
    const float lit = pebbles.nearest(x - 1, y - 1) - pebbles.nearest(x + 1, y + 1);
    const float shade =
        is_pebble ? shade_of[pebbles.id[i]] * (1.0F - 1.6F * lit) : 0.6F * sand_shade[sand.id[i]];
    return shade * (1.0F + 0.08F * grain(x, y)) * Vector3f(1.0F, 0.96F, 0.9F);
  });
}

}  // namespace km::recipes
