#include <algorithm>
#include <array>
#include <cmath>

#include "modules/simulation/world/noise_field.hpp"
#include "modules/simulation/world/recipes.hpp"

namespace km::recipes {

using Eigen::Vector2f;
using Eigen::Vector3f;

namespace {

/// Threads crossing every `pitch` texels: -1 to 1.
float weave(int x, int y, int pitch) {
  const bool over = ((x / pitch) + (y / pitch)) % 2 == 0;
  const int along = over ? x % pitch : y % pitch;
  return (over ? 0.6F : -0.6F) + (2 * along < pitch ? 0.4F : -0.4F);
}

}  // namespace

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

Canvas foam_mat(int size, SeededRandom& random) {
  const NoiseField scuffs = fractal_noise(size, {.gain = 0.85F}, random);
  const int mat = size / 2;
  const auto tooth = [mat](int along) {  // the outline swings to both sides: a jigsaw's edge
    const float phase = 6.28318F * 6.0F * static_cast<float>(along) / static_cast<float>(mat);
    return static_cast<int>(std::clamp(2.5F * std::sin(phase), -1.0F, 1.0F) *
                            static_cast<float>(mat) / 40.0F);
  };
  std::array<float, 4> shade_of{};
  for (float& shade : shade_of) shade = random.uniform(0.72F, 0.8F);
  return Canvas::painted(size, [&](int x, int y) -> Vector3f {
    const int u = x + tooth(y) + size;
    const int v = y + tooth(x) + size;
    const auto index = static_cast<std::size_t>((u / mat) % 2 + 2 * ((v / mat) % 2));
    float shade = shade_of[index] * (1.0F + 0.05F * scuffs(x, y));
    const int to_edge = std::min(u % mat, v % mat);
    if (to_edge < 2) return Vector3f::Constant(0.16F);
    const bool ridge = (x + y) % 8 < 3 && (x - y + size) % 8 < 5;  // grip
    if (ridge) shade *= 0.86F;
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

}  // namespace km::recipes
