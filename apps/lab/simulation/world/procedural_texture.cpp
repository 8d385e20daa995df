#include "apps/lab/simulation/world/procedural_texture.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include "apps/lab/simulation/world/canvas.hpp"
#include "apps/lab/simulation/world/printed_textures.hpp"

namespace km {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

/// Brightness of each cell of a cell noise, drawn uniformly.
std::vector<float> shades(int count, float low, float high, SeededRandom& random) {
  std::vector<float> result(static_cast<std::size_t>(count));
  for (float& shade : result) shade = random.uniform(low, high);
  return result;
}

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
    if (random.unit() < bare(static_cast<int>(foot.x() * n), static_cast<int>(foot.y() * n)))
      continue;
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
    std::array<float, kMaxBlocks> end{};  // end of each block, in tiles; the last is 1
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
  constexpr int kLeafCount = 5200;
  for (int i = 0; i < kLeafCount; ++i) {
    const float height = static_cast<float>(i) / kLeafCount;  // later leaves lie further out
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

/// Threads crossing every `pitch` texels: -1 to 1.
float weave(int x, int y, int pitch) {
  const bool over = ((x / pitch) + (y / pitch)) % 2 == 0;
  const int along = over ? x % pitch : y % pitch;
  return (over ? 0.6F : -0.6F) + (2 * along < pitch ? 0.4F : -0.4F);
}

Canvas plain(int size, SeededRandom& random) {
  const NoiseField unevenness = fractal_noise(size, {.gain = 0.8F}, random);
  return Canvas::painted(size, [&](int x, int y) -> Vector3f {
    return Vector3f::Constant(0.85F * (1.0F + 0.018F * unevenness(x, y)));
  });
}

Canvas painted_metal(int size, SeededRandom& random) {
  const NoiseField dirt = fractal_noise(size, {.gain = 0.8F}, random);
  const NoiseField runs = fractal_noise(size, {.cells_u = 16, .cells_v = 1, .gain = 0.9F}, random);
  const int half = size / 2;
  Canvas canvas = Canvas::painted(size, [&](int x, int y) -> Vector3f {
    const float grime = smooth_step(0.8F, 3.0F, runs(x, y) + 0.7F * dirt(x, y));
    float shade = 0.8F * (1.0F + 0.02F * dirt(x, y)) * (1.0F - 0.35F * grime);
    const int to_seam = std::min(x % half, y % half);
    if (to_seam < 2) shade *= 0.5F;
    if (to_seam == 2) shade *= 1.1F;
    return Vector3f(shade, shade * (1.0F - 0.08F * grime), shade * (1.0F - 0.15F * grime));
  });
  for (int i = 0; i < 60; ++i) {  // scratches down to the primer
    const Vector2f at(random.uniform(0.0F, 1.0F), random.uniform(0.0F, 1.0F));
    const Vector2f along(random.uniform(-0.05F, 0.05F), random.uniform(-0.05F, 0.05F));
    canvas.line(at, at + along, 0.002F, Vector3f::Constant(random.uniform(0.3F, 0.55F)));
  }
  for (int i = 0; i < 32; ++i) {  // rivets beside the seams
    const float along = (static_cast<float>(i % 16) + 0.5F) / 16.0F;
    const float across = i < 16 ? 0.02F : 0.52F;
    canvas.ellipse({across, along}, {0.004F, 0.004F}, 0.0F, Vector3f::Constant(0.55F));
  }
  return canvas;
}

Canvas corrugated_metal(int size, SeededRandom& random) {
  constexpr float kRibs = 20.0F;
  const NoiseField dirt = fractal_noise(size, {.gain = 0.85F}, random);
  const NoiseField runs = fractal_noise(size, {.cells_u = 16, .cells_v = 2, .gain = 0.9F}, random);
  return Canvas::painted(size, [&](int x, int y) -> Vector3f {
    const float phase = 6.28318F * kRibs * static_cast<float>(x) / static_cast<float>(size);
    const float rib = std::clamp(2.2F * std::sin(phase), -1.0F, 1.0F);  // flat tops, steep flanks
    const float flank = std::cos(phase) * (1.0F - std::abs(rib));
    const float rust = smooth_step(1.1F, 2.6F, runs(x, y) + 0.6F * dirt(x, y));
    const float shade = (0.72F + 0.08F * rib + 0.35F * flank) * (1.0F + 0.03F * dirt(x, y));
    const Vector3f paint = Vector3f::Constant(shade);
    const Vector3f brown = shade * Vector3f(0.42F, 0.22F, 0.12F);
    return paint + rust * (brown - paint);
  });
}

Canvas wood_planks(int size, SeededRandom& random) {
  constexpr int kBoards = 16;
  std::array<float, kBoards> shade_of{};
  std::array<float, kBoards> joint{};
  std::array<int, kBoards> shift{};
  for (std::size_t i = 0; i < kBoards; ++i) {
    shade_of[i] = random.uniform(0.75F, 1.2F);
    joint[i] = random.uniform(0.0F, 1.0F);
    shift[i] = random.below(size);
  }
  const NoiseField grain =
      fractal_noise(size, {.cells_u = 2, .cells_v = 64, .gain = 0.85F}, random);
  const NoiseField wear = fractal_noise(size, {.cells_u = 4, .cells_v = 16, .gain = 0.9F}, random);
  const int board = size / kBoards;
  const auto n = static_cast<float>(size);
  Canvas canvas = Canvas::painted(size, [&](int x, int y) -> Vector3f {
    const auto b = static_cast<std::size_t>(y / board);
    const int in_board = y % board;
    const float from_joint = std::abs(static_cast<float>(x) / n - joint[b]);
    if (in_board == 0 || from_joint < 1.5F / n) return Vector3f(0.025F, 0.02F, 0.015F);
    const float veins = std::sin(5.0F * grain(x + shift[b], y));
    float shade = shade_of[b] * (1.0F + 0.13F * grain(x + shift[b], y) + 0.08F * veins);
    shade *= 1.0F + 0.14F * wear(x, y);
    if (in_board == 1 || in_board == board - 1) shade *= 0.7F;
    return shade * Vector3f(0.36F, 0.26F, 0.17F);
  });
  for (std::size_t b = 0; b < kBoards; ++b) {  // knots and nails
    const float v = (static_cast<float>(b) + 0.5F) / kBoards;
    const Vector2f knot(random.uniform(0.0F, 1.0F), v + random.uniform(-0.01F, 0.01F));
    canvas.ellipse(knot, {0.009F, 0.006F}, 0.0F, Vector3f(0.1F, 0.06F, 0.035F));
    canvas.ellipse(knot, {0.005F, 0.003F}, 0.0F, Vector3f(0.05F, 0.03F, 0.02F));
    for (const float side : {-0.35F, 0.35F}) {
      const Vector2f nail(joint[b] + 0.012F, v + side / kBoards);
      canvas.ellipse(nail, {0.002F, 0.002F}, 0.0F, Vector3f::Constant(0.04F));
    }
  }
  return canvas;
}

Canvas canvas_cloth(int size, SeededRandom& random) {
  const NoiseField folds = relief(fractal_noise(size, {.gain = 0.45F, .finest = 128}, random));
  const NoiseField dirt = fractal_noise(size, {.gain = 0.9F}, random);
  const int half = size / 2;
  return Canvas::painted(size, [&](int x, int y) -> Vector3f {
    float shade = 0.75F * (1.0F + 0.05F * folds(x, y) + 0.045F * dirt(x, y));
    shade *= 1.0F + 0.04F * weave(x, y, 2);
    const int seam = x % half;
    if (seam < 1 || seam == 6) shade *= 0.7F;                   // edges of the overlap
    if ((seam == 2 || seam == 4) && y % 8 < 5) shade *= 0.78F;  // stitches
    return Vector3f::Constant(shade);
  });
}

Canvas carpet(int size, SeededRandom& random) {
  const NoiseField pile =
      fractal_noise(size, {.cells_u = 32, .cells_v = 32, .gain = 1.15F}, random);
  const NoiseField wear = fractal_noise(size, {.gain = 0.9F}, random);
  Canvas canvas = Canvas::painted(size, [&](int x, int y) -> Vector3f {
    return Vector3f::Constant(0.7F * (1.0F + 0.03F * pile(x, y) + 0.015F * wear(x, y)));
  });
  for (int i = 0; i < 500; ++i) {  // fluff and flecks
    const Vector2f at(random.uniform(0.0F, 1.0F), random.uniform(0.0F, 1.0F));
    const float radius = random.uniform(0.0012F, 0.0028F);
    const float shade =
        random.chance(0.6) ? random.uniform(0.35F, 0.5F) : random.uniform(0.85F, 1.0F);
    canvas.ellipse(at, {radius, radius}, 0.0F, Vector3f::Constant(shade));
  }
  return canvas;
}

Canvas curtain(int size, SeededRandom& random) {
  const NoiseField creases = relief(
      fractal_noise(size, {.cells_u = 8, .cells_v = 1, .gain = 0.7F, .finest = 256}, random));
  const NoiseField fibres =
      fractal_noise(size, {.cells_u = 64, .cells_v = 16, .gain = 1.0F}, random);
  return Canvas::painted(size, [&](int x, int y) -> Vector3f {
    float shade = 0.82F * (1.0F + 0.065F * creases(x, y) + 0.025F * fibres(x, y));
    shade *= 1.0F + 0.02F * weave(x, y, 2);
    return Vector3f::Constant(shade);
  });
}

Canvas mattress(int size, SeededRandom& random) {
  const NoiseField bend = fractal_noise(size, {.gain = 0.5F, .finest = 32}, random);
  const NoiseField tension =
      fractal_noise(size, {.cells_u = 2, .cells_v = 16, .gain = 0.75F, .finest = 128}, random);
  const NoiseField place = fractal_noise(size, {.gain = 0.5F, .finest = 16}, random);
  const NoiseField threads =
      fractal_noise(size, {.cells_u = 16, .cells_v = 64, .gain = 1.0F}, random);
  const auto n = static_cast<float>(size);
  return Canvas::painted(size, [&](int x, int y) -> Vector3f {
    // Creases run along u and hang through a little: lit above, dark below.
    const int sag = static_cast<int>(0.012F * n * bend(x, y));
    const float crease = std::clamp(tension(x, y + sag) - tension(x, y + sag - 4), -0.8F, 0.8F);
    const float amount = smooth_step(-0.5F, 1.5F, place(x, y));
    float shade = 0.72F * (1.0F + 0.2F * amount * crease + 0.03F * threads(x, y));
    shade *= 1.0F + 0.02F * weave(x, y, 2);
    return Vector3f::Constant(shade);
  });
}

Canvas detail_flat(int size, SeededRandom& /*random*/) {
  return Canvas(size, Vector3f::Constant(0.5F));
}

Canvas detail_grain(int size, SeededRandom& random) {
  const NoiseField grain = fractal_noise(size, {.cells_u = 8, .cells_v = 8, .gain = 1.0F}, random);
  return Canvas::painted(size, [&](int x, int y) -> Vector3f {
    return Vector3f::Constant(0.5F * (1.0F + 0.05F * grain(x, y)));
  });
}

Canvas detail_stains(int size, SeededRandom& random) {
  const NoiseField soft = fractal_noise(size, {.gain = 0.8F}, random);
  return Canvas::painted(size, [&](int x, int y) -> Vector3f {
    return Vector3f::Constant(0.5F * (1.0F + 0.09F * std::clamp(soft(x, y), -3.0F, 3.0F)));
  });
}

using Make = Canvas (*)(int size, SeededRandom& random);

struct Entry {
  RecipeTraits traits;
  std::uint64_t stream;  // stream of random draws: independent of the number of other recipes
  Make make;
};

constexpr Recipe kFlat = Recipe::kDetailFlat;
constexpr Recipe kGrain = Recipe::kDetailGrain;
constexpr Recipe kStains = Recipe::kDetailStains;

// Recipe, name, size, period, detail, period of the detail. The two periods have no common multiple
// below several dozens of either.
constexpr Entry kEntries[] = {
    {{Recipe::kPlain, "plain", 256, 2.0F, kFlat, 1.0F}, 0, plain},
    {{Recipe::kAsphalt, "asphalt", 1024, 4.0F, kStains, 9.31F}, 1, asphalt},
    {{Recipe::kConcrete, "concrete", 512, 4.0F, kGrain, 0.83F}, 2, concrete},
    {{Recipe::kPavers, "pavers", 512, 4.0F, kGrain, 0.83F}, 3, pavers},
    {{Recipe::kPlaster, "plaster", 512, 4.0F, kGrain, 0.77F}, 4, plaster},
    {{Recipe::kBrick, "brick", 512, 1.2F, kStains, 5.93F}, 5, brick},
    {{Recipe::kStoneBlocks, "stone_blocks", 512, 3.0F, kGrain, 0.71F}, 6, stone_blocks},
    {{Recipe::kRoofTiles, "roof_tiles", 512, 2.0F, kStains, 6.37F}, 7, roof_tiles},
    {{Recipe::kGrass, "grass", 1024, 4.0F, kStains, 11.7F}, 8, grass},
    {{Recipe::kSoil, "soil", 512, 6.0F, kGrain, 0.97F}, 9, soil},
    {{Recipe::kGravel, "gravel", 512, 2.0F, kStains, 7.19F}, 10, gravel},
    {{Recipe::kBark, "bark", 512, 1.0F, kStains, 2.83F}, 11, bark},
    {{Recipe::kLeaves, "leaves", 512, 2.0F, kStains, 5.37F}, 12, leaves},
    {{Recipe::kPaintedMetal, "painted_metal", 512, 2.0F, kGrain, 0.61F}, 13, painted_metal},
    {{Recipe::kCorrugatedMetal, "corrugated_metal", 512, 2.0F, kStains, 5.71F},
     14,
     corrugated_metal},
    {{Recipe::kCanvas, "canvas", 512, 2.0F, kGrain, 0.37F}, 15, canvas_cloth},
    {{Recipe::kWoodPlanks, "wood_planks", 1024, 2.0F, kStains, 3.41F}, 16, wood_planks},
    {{Recipe::kCarpet, "carpet", 512, 2.0F, kFlat, 1.0F}, 18, carpet},
    {{Recipe::kCurtain, "curtain", 512, 2.0F, kGrain, 0.43F}, 19, curtain},
    {{Recipe::kMattress, "mattress", 512, 2.0F, kFlat, 1.0F}, 21, mattress},
    {{Recipe::kPlayMat, "play_mat", 1024, 2.0F, kStains, 3.13F}, 22, play_mat},
    {{Recipe::kMarkerTape, "marker_tape", 1024, 2.0F, kGrain, 0.59F}, 23, marker_tape},
    {{Recipe::kTagGrid, "tag_grid", 512, 1.0F, kFlat, 1.0F}, 24, tag_grid},
    {{Recipe::kChecker, "checker", 256, 1.0F, kFlat, 1.0F}, 25, checker},
    {{Recipe::kPosters, "posters", 1024, 4.0F, kGrain, 0.91F}, 26, posters},
    {{Recipe::kNewsprint, "newsprint", 1024, 1.0F, kStains, 2.17F}, 27, newsprint},
    {{Recipe::kDetailFlat, "detail_flat", 1, 1.0F, kFlat, 1.0F}, 28, detail_flat},
    {{Recipe::kDetailGrain, "detail_grain", 512, 1.0F, kFlat, 1.0F}, 29, detail_grain},
    {{Recipe::kDetailStains, "detail_stains", 512, 1.0F, kFlat, 1.0F}, 30, detail_stains},
};
static_assert(std::size(kEntries) == kRecipeCount);

const Entry& entry_of(Recipe recipe) {
  const auto index = static_cast<std::size_t>(recipe);
  if (index >= std::size(kEntries))
    throw std::invalid_argument("no recipe has number " + std::to_string(index));
  return kEntries[index];
}

}  // namespace

const RecipeTraits& traits_of(Recipe recipe) {
  return entry_of(recipe).traits;
}

Texture make_texture(Recipe recipe, std::uint64_t seed) {
  const Entry& entry = entry_of(recipe);
  SeededRandom random = SeededRandom::stream(seed, entry.stream);
  const int size = entry.traits.size;
  return Texture(size, entry.make(size, random).take());
}

}  // namespace km
