#include <algorithm>
#include <array>
#include <cmath>

#include "modules/simulation/world/noise_field.hpp"
#include "modules/simulation/world/recipes.hpp"

namespace km::recipes {

using Eigen::Vector2f;
using Eigen::Vector3f;

Canvas plaster(int size, SeededRandom& random) {
  const NoiseField bumps =
      relief(fractal_noise(size, {.cells_u = 16, .cells_v = 16, .gain = 0.75F}, random));
  const NoiseField stains = fractal_noise(size, {.gain = 0.7F}, random);
  const NoiseField runs = fractal_noise(size, {.cells_u = 16, .cells_v = 1, .gain = 0.8F}, random);
  return Canvas::painted(size, [&](int x, int y) -> Vector3f {
    const float dirt = smooth_step(0.6F, 2.6F, runs(x, y) + 0.5F * stains(x, y));
    const float shade = 0.78F * (1.0F + 0.035F * bumps(x, y) + 0.03F * stains(x, y));
    return shade * (1.0F - 0.22F * dirt) * Vector3f(1.0F, 0.985F, 0.96F);
  });
}

Canvas brick(int size, SeededRandom& random) {
  constexpr int kCourses = 16;
  constexpr int kBricks = 5;
  std::array<float, kCourses * kBricks> shade_of{};
  std::array<float, kCourses * kBricks> redness{};
  for (std::size_t i = 0; i < shade_of.size(); ++i) {
    shade_of[i] = random.chance(0.12) ? random.uniform(0.35F, 0.6F) : random.uniform(0.75F, 1.3F);
    redness[i] = random.uniform(0.8F, 1.2F);
  }
  const NoiseField bend = fractal_noise(size, {.cells_u = 16, .cells_v = 16}, random);
  const NoiseField grain = fractal_noise(size, {.cells_u = 8, .cells_v = 8, .gain = 1.0F}, random);
  const auto n = static_cast<float>(size);
  return Canvas::painted(size, [&](int x, int y) -> Vector3f {
    const float v = kCourses * (static_cast<float>(y) + 0.6F * bend(x, y)) / n;
    const int course = static_cast<int>(std::floor(v)) & (kCourses - 1);
    const float offset = course % 2 == 0 ? 0.0F : 0.5F;
    const float u =
        kBricks * (static_cast<float>(x) + 0.6F * bend(x + size / 2, y + size / 3)) / n + offset;
    const auto brick = static_cast<int>(std::floor(u) + kBricks) % kBricks;
    const float in_v = v - std::floor(v);
    const float in_u = u - std::floor(u);
    const bool mortar = in_v < 0.14F || in_u < 0.045F;
    if (mortar) return (0.36F + 0.03F * grain(x, y)) * Vector3f(1.0F, 0.97F, 0.9F);
    const auto i = static_cast<std::size_t>(course * kBricks + brick);
    const float edge = in_v < 0.2F ? 0.85F : (in_v > 0.94F ? 1.12F : 1.0F);
    const float shade = edge * shade_of[i] * (1.0F + 0.13F * grain(x, y));
    return shade * Vector3f(0.30F * redness[i], 0.135F, 0.085F);
  });
}

Canvas stone_blocks(int size, SeededRandom& random) {
  constexpr int kCourses = 8;
  constexpr int kMaxBlocks = 6;
  struct Course {
    std::array<float, kMaxBlocks> end{};  // of each block, in tiles; the last is 1
    std::array<float, kMaxBlocks> shade{};
    float shift = 0.0F;
  };
  std::array<Course, kCourses> courses;
  for (Course& course : courses) {
    float total = 0.0F;
    for (float& end : course.end) end = total += random.uniform(0.6F, 1.5F);
    for (float& end : course.end) end /= total;
    for (float& shade : course.shade) shade = random.uniform(0.7F, 1.2F);
    course.shift = random.uniform(0.0F, 1.0F);
  }
  const NoiseField bend = fractal_noise(size, {.cells_u = 16, .cells_v = 16}, random);
  const NoiseField grain = fractal_noise(size, {.cells_u = 8, .cells_v = 8, .gain = 0.95F}, random);
  const NoiseField slope = relief(grain);
  const auto n = static_cast<float>(size);
  return Canvas::painted(size, [&](int x, int y) -> Vector3f {
    const float v = kCourses * (static_cast<float>(y) + 1.0F * bend(x, y)) / n;
    const Course& course = courses[static_cast<std::size_t>(std::floor(v)) & (kCourses - 1)];
    float u = (static_cast<float>(x) + 1.0F * bend(x + size / 2, y + size / 3)) / n + course.shift;
    u -= std::floor(u);
    std::size_t block = 0;
    while (u > course.end[block] && block + 1 < kMaxBlocks) ++block;
    const float from = block == 0 ? 0.0F : course.end[block - 1];
    const float in_v = v - std::floor(v);
    const bool joint = in_v < 0.05F || u - from < 0.006F;
    const float relief_shade = 1.0F + 0.1F * grain(x, y) + 0.06F * slope(x, y);
    const float shade = joint ? 0.16F : 0.38F * course.shade[block] * relief_shade;
    return shade * Vector3f(1.0F, 0.95F, 0.84F);
  });
}

Canvas roof_tiles(int size, SeededRandom& random) {
  constexpr int kRows = 8;
  constexpr int kColumns = 10;
  std::array<float, kRows * kColumns> shade_of{};
  for (float& shade : shade_of) shade = random.uniform(0.7F, 1.25F);
  const NoiseField moss = fractal_noise(size, {.gain = 0.9F}, random);
  const auto n = static_cast<float>(size);
  return Canvas::painted(size, [&](int x, int y) -> Vector3f {
    const float v = kRows * static_cast<float>(y) / n;
    const int row = static_cast<int>(v);
    const float u = kColumns * static_cast<float>(x) / n + (row % 2 == 0 ? 0.0F : 0.5F);
    const int column = static_cast<int>(u) % kColumns;
    const float in_v = v - static_cast<float>(row);
    const float in_u = u - std::floor(u);
    const float round = 0.62F + 0.5F * std::sin(3.14159F * in_u);  // each tile is arched
    const float shadow = in_v > 0.88F ? 0.45F : (in_v < 0.06F ? 1.2F : 1.0F);
    const auto i = static_cast<std::size_t>(row * kColumns + column);
    const float shade = shade_of[i] * round * shadow * (1.0F + 0.12F * moss(x, y));
    const float green = 0.25F * smooth_step(1.0F, 2.4F, moss(x, y));
    return shade * Vector3f(0.29F * (1.0F - green), 0.13F, 0.08F);
  });
}

Canvas bark(int size, SeededRandom& random) {
  const NoiseField ridges =
      fractal_noise(size, {.cells_u = 16, .cells_v = 2, .gain = 0.75F}, random);
  const NoiseField grain = fractal_noise(size, {.cells_u = 16, .cells_v = 4, .gain = 1.0F}, random);
  return Canvas::painted(size, [&](int x, int y) -> Vector3f {
    const float furrow = smooth_step(0.45F, 0.0F, std::abs(ridges(x, y)));
    const float slope = ridges(x, y) - ridges(x - 2, y);
    const float shade = (1.0F + 0.16F * grain(x, y) + 0.5F * slope) * (1.0F - 0.65F * furrow);
    return shade * Vector3f(0.19F, 0.15F, 0.11F);
  });
}

Canvas leaves(int size, SeededRandom& random) {
  const NoiseField depth = fractal_noise(size, {.gain = 0.8F}, random);
  Canvas canvas = Canvas::painted(size, [&](int x, int y) -> Vector3f {
    return std::max(1.0F + 0.4F * depth(x, y), 0.2F) * Vector3f(0.012F, 0.02F, 0.008F);
  });
  constexpr int kLeaves = 5200;
  for (int i = 0; i < kLeaves; ++i) {
    const float height = static_cast<float>(i) / kLeaves;  // later leaves lie further out
    const Vector2f at(random.uniform(0.0F, 1.0F), random.uniform(0.0F, 1.0F));
    const float length = random.uniform(0.008F, 0.019F);
    const float angle = random.uniform(0.0F, 3.1416F);
    const float lit = random.uniform(0.5F, 1.3F) * (0.3F + 0.7F * height);
    const Vector3f color =
        lit * Vector3f(random.uniform(0.06F, 0.11F), random.uniform(0.12F, 0.17F), 0.035F);
    const Vector2f axes(length, length * random.uniform(0.35F, 0.6F));
    canvas.ellipse(at, axes, angle, color);
    const Vector2f half(0.9F * length * std::cos(angle), 0.9F * length * std::sin(angle));
    canvas.line(at - half, at + half, 0.0012F, 1.35F * color);  // the midrib
  }
  return canvas;
}

}  // namespace km::recipes
