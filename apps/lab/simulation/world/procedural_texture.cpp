#include "apps/lab/simulation/world/procedural_texture.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "apps/lab/simulation/world/canvas.hpp"
#include "apps/lab/simulation/world/printed_textures.hpp"

namespace km {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

using Rgb = std::array<float, 3>;

Vector3f color(const Rgb& rgb) {
  return {rgb[0], rgb[1], rgb[2]};
}

/// Ground, bark or foliage: noise with spots on it, such as stones, blades and leaves.
struct Speckles {
  FractalNoise noise;
  float contrast;
  Rgb rgb;
  int spots;
  float least, largest;  ///< Half length of a spot, in tiles; small ones are more frequent.
  float narrow;          ///< Width of the narrowest spot as a share of its length.
  float dark, bright;    ///< Factors of the colour of spots.
  Rgb spot_rgb;
};

template <const Speckles& look>
Canvas speckled(int size, SeededRandom& random) {
  const NoiseField noise = fractal_noise(size, look.noise, random);
  Canvas canvas = Canvas::painted(size, [&](int x, int y) -> Vector3f {
    return std::max(1.0F + look.contrast * noise(x, y), 0.2F) * color(look.rgb);
  });
  for (int i = 0; i < look.spots; ++i) {
    const float u = random.uniform(0.0F, 1.0F);
    const Vector2f at(u, random.uniform(0.0F, 1.0F));
    const float share = random.uniform(0.0F, 1.0F);
    const float length = look.least + (look.largest - look.least) * share * share * share;
    const float width = length * random.uniform(look.narrow, 1.5F * look.narrow);
    const float angle = random.uniform(0.0F, 3.1416F);
    canvas.ellipse(at, {length, width}, angle,
                   random.uniform(look.dark, look.bright) * color(look.spot_rgb));
  }
  return canvas;
}

/// Rows of bricks, blocks, slabs or tiles with joints between them.
struct Masonry {
  int rows, columns;
  float shift;         ///< Shift of every second row, in columns.
  float joint;         ///< Width of joints, in rows.
  float dark, bright;  ///< Factors of the colour of bricks.
  float grain;         ///< Contrast within one.
  float arch;          ///< Contrast from the sides to the middle of one.
  Rgb rgb;
  float joint_shade;
};

template <const Masonry& look>
Canvas masonry(int size, SeededRandom& random) {
  std::vector<float> shades;
  for (int i = 0; i < look.rows * look.columns; ++i)
    shades.push_back(random.uniform(look.dark, look.bright));
  const NoiseField bend = fractal_noise(size, {.cells_u = 16, .cells_v = 16}, random);
  const NoiseField grain = fractal_noise(size, {.cells_u = 8, .cells_v = 8, .gain = 1.0F}, random);
  const auto n = static_cast<float>(size);
  return Canvas::painted(size, [&](int x, int y) -> Vector3f {
    const auto rows = static_cast<float>(look.rows), columns = static_cast<float>(look.columns);
    const float v = rows * (static_cast<float>(y) + 0.6F * bend(x, y)) / n + rows;
    const int row = static_cast<int>(v) % look.rows;
    const float from = row % 2 == 0 ? 0.0F : look.shift;
    const float u =
        columns * (static_cast<float>(x) + 0.6F * bend(x + size / 2, y + size / 3)) / n + columns +
        from;
    const int column = static_cast<int>(u) % look.columns;
    const float in_v = v - std::floor(v), in_u = u - std::floor(u);
    if (in_v < look.joint || in_u < look.joint * columns / rows)
      return look.joint_shade * (1.0F + 0.08F * grain(x, y)) * Vector3f(1.0F, 0.97F, 0.9F);
    const float edge = in_v > 0.92F ? 1.12F : 1.0F;  // the lit edge
    const float round = 1.0F + look.arch * (std::sin(3.14159F * in_u) - 0.6F);
    const float shade = shades[static_cast<std::size_t>(row * look.columns + column)];
    return edge * round * shade * (1.0F + look.grain * grain(x, y)) * color(look.rgb);
  });
}

constexpr Speckles kAsphaltLook = {
    {4, 4, 0.9F}, 0.13F, {0.11F, 0.109F, 0.106F}, 9000, 0.0009F, 0.004F, 0.7F,
    0.5F,         1.7F,  {0.11F, 0.109F, 0.106F}};
constexpr Speckles kSoilLook = {
    {4, 4, 0.95F}, 0.25F, {0.25F, 0.19F, 0.13F}, 900, 0.0012F, 0.007F, 0.6F,
    0.3F,          1.6F,  {0.3F, 0.28F, 0.26F}};
constexpr Speckles kGravelLook = {
    {4, 4, 1.0F}, 0.15F, {0.16F, 0.154F, 0.144F}, 9000, 0.004F, 0.014F, 0.6F,
    0.45F,        1.5F,  {0.4F, 0.385F, 0.36F}};
constexpr Speckles kGrassLook = {
    {4, 4, 0.8F}, 0.3F, {0.07F, 0.09F, 0.033F}, 40000, 0.003F, 0.006F, 0.15F,
    0.45F,        2.0F, {0.085F, 0.11F, 0.035F}};
constexpr Speckles kLeavesLook = {
    {4, 4, 0.8F}, 0.4F, {0.012F, 0.02F, 0.008F}, 6000, 0.008F, 0.019F, 0.4F,
    0.3F,         1.3F, {0.085F, 0.145F, 0.035F}};
constexpr Speckles kBarkLook = {
    {16, 2, 0.85F}, 0.35F, {0.19F, 0.15F, 0.11F}, 0, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, {}};

constexpr Masonry kConcreteLook = {
    2, 2, 0.0F, 0.008F, 0.92F, 1.06F, 0.085F, 0.0F, {0.42F, 0.41F, 0.395F}, 0.17F};
constexpr Masonry kPaversLook = {
    8, 8, 0.0F, 0.03F, 0.78F, 1.14F, 0.11F, 0.0F, {0.34F, 0.33F, 0.31F}, 0.14F};
constexpr Masonry kBrickLook = {
    16, 5, 0.5F, 0.14F, 0.6F, 1.3F, 0.13F, 0.0F, {0.3F, 0.135F, 0.085F}, 0.36F};
constexpr Masonry kStoneLook = {
    8, 6, 0.37F, 0.05F, 0.7F, 1.2F, 0.12F, 0.0F, {0.38F, 0.36F, 0.32F}, 0.16F};
constexpr Masonry kTilesLook = {
    8, 10, 0.5F, 0.1F, 0.7F, 1.25F, 0.12F, 0.5F, {0.29F, 0.13F, 0.08F}, 0.06F};

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
    {{Recipe::kAsphalt, "asphalt", 1024, 4.0F, kStains, 9.31F}, 1, speckled<kAsphaltLook>},
    {{Recipe::kConcrete, "concrete", 512, 4.0F, kGrain, 0.83F}, 2, masonry<kConcreteLook>},
    {{Recipe::kPavers, "pavers", 512, 4.0F, kGrain, 0.83F}, 3, masonry<kPaversLook>},
    {{Recipe::kPlaster, "plaster", 512, 4.0F, kGrain, 0.77F}, 4, plaster},
    {{Recipe::kBrick, "brick", 512, 1.2F, kStains, 5.93F}, 5, masonry<kBrickLook>},
    {{Recipe::kStoneBlocks, "stone_blocks", 512, 3.0F, kGrain, 0.71F}, 6, masonry<kStoneLook>},
    {{Recipe::kRoofTiles, "roof_tiles", 512, 2.0F, kStains, 6.37F}, 7, masonry<kTilesLook>},
    {{Recipe::kGrass, "grass", 1024, 4.0F, kStains, 11.7F}, 8, speckled<kGrassLook>},
    {{Recipe::kSoil, "soil", 512, 6.0F, kGrain, 0.97F}, 9, speckled<kSoilLook>},
    {{Recipe::kGravel, "gravel", 512, 2.0F, kStains, 7.19F}, 10, speckled<kGravelLook>},
    {{Recipe::kBark, "bark", 512, 1.0F, kStains, 2.83F}, 11, speckled<kBarkLook>},
    {{Recipe::kLeaves, "leaves", 512, 2.0F, kStains, 5.37F}, 12, speckled<kLeavesLook>},
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
  return kEntries[static_cast<std::size_t>(recipe)];
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
