#include "modules/simulation/world/city_blocks.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "modules/simulation/world/building.hpp"
#include "modules/simulation/world/park.hpp"
#include "modules/simulation/world/street_furniture.hpp"
#include "modules/simulation/world/vegetation.hpp"

namespace km {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

constexpr float kPi = std::numbers::pi_v<float>;
constexpr float kDepth_m = 11.0F;  // of the houses on the long sides
constexpr int kParkColumn = 1;
constexpr int kParkRow = 1;

/// Widths of lots that fill `length`, 9 to 14 m each, or all alike.
std::vector<float> lots(float length, bool alike, SeededRandom& random) {
  std::vector<float> widths;
  if (alike) {
    const int count = std::max(1, static_cast<int>(length / 9.0F));
    widths.assign(static_cast<std::size_t>(count), length / static_cast<float>(count));
    return widths;
  }
  float left = length;
  while (left > 20.0F) {
    widths.push_back(random.uniform(9.0F, 14.0F));
    left -= widths.back();
  }
  widths.push_back(left);
  return widths;
}

/// The houses along one side; those at its ends show a second street their side.
void add_row(Scene& scene, const StreetSide& side, bool open_ends, bool terrace,
             std::uint64_t seed) {
  SeededRandom random = SeededRandom::stream(seed, 20);
  float x = 0.0F;
  const std::vector<float> widths = lots(side.length_m, terrace, random);
  for (std::size_t i = 0; i < widths.size(); ++i) {
    Building house = random_building(scene, terrace ? seed : seed + 1000 * (i + 1));
    house.width_m = widths[i];
    house.depth_m = kDepth_m;
    const bool first = i == 0;
    const bool last = i + 1 == widths.size();
    house.walls = {WallKind::kRich, last && open_ends ? WallKind::kRich : WallKind::kBlind,
                   open_ends ? WallKind::kPlain : WallKind::kNone,
                   first && open_ends ? WallKind::kRich : WallKind::kBlind};
    const ScopedFrame frame(scene.mesh, side.T_world_side * standing_at({x, 0.0F, 0.0F}, 0.0F));
    add_building(scene, house);
    x += widths[i];
  }
}

/// A gap between rows: a fenced garden with a tree and bushes.
void add_garden(Scene& scene, const StreetSide& side, SeededRandom& random) {
  const ScopedFrame frame(scene.mesh, side.T_world_side);
  const float length = side.length_m;
  {
    const ScopedFrame line(scene.mesh, standing_at({0.0F, 0.1F, 0.0F}, 0.0F));
    const int kind = random.below(3);
    if (kind == 0) add_railing(scene, length, 1.5F);
    if (kind == 1) add_plank_fence(scene, length, 1.8F);
    if (kind == 2) add_hedge(scene, length, 0.7F, 1.5F, random);
  }
  const float deep = 7.0F;
  for (const float x : {0.3F * length, 0.75F * length}) {
    const ScopedFrame at(scene.mesh, standing_at({x, random.uniform(2.8F, deep), 0.0F}, 0.0F));
    add_tree(scene, {.height_m = random.uniform(6.0F, 8.5F)}, random);
  }
  for (int i = 0; i < 4; ++i) {
    const ScopedFrame at(
        scene.mesh,
        standing_at({random.uniform(1.0F, length - 1.0F), random.uniform(1.5F, deep), 0.0F}, 0.0F));
    add_bush(scene, random.uniform(0.5F, 0.9F), random);
  }
}

/// A short side between the two rows of a block: a house or a garden.
void add_short_side(Scene& scene, StreetSide side, bool garden, std::uint64_t seed) {
  side.T_world_side = side.T_world_side * standing_at({kDepth_m, 0.0F, 0.0F}, 0.0F);
  side.length_m -= 2.0F * kDepth_m;
  if (garden) {
    SeededRandom random = SeededRandom::stream(seed, 21);
    add_garden(scene, side, random);
    return;
  }
  Building house = random_building(scene, seed);
  house.width_m = side.length_m;
  house.depth_m = 9.0F;
  house.walls = {WallKind::kRich, WallKind::kBlind, WallKind::kNone, WallKind::kBlind};
  const ScopedFrame frame(scene.mesh, side.T_world_side);
  add_building(scene, house);
}

/// Towers behind the outer houses.
void add_skyline(Scene& scene, const CityPlan& plan, std::uint64_t seed) {
  SeededRandom random = SeededRandom::stream(seed, 22);
  for (const StreetSide& side : plan.outer_sides()) {
    for (float x = random.uniform(5.0F, 30.0F); x < side.length_m - 20.0F;
         x += random.uniform(35.0F, 60.0F)) {
      Building tower =
          random_building(scene, seed + static_cast<std::uint64_t>(random.below(1000)));
      tower.style.floors = 8 + random.below(5);
      tower.width_m = random.uniform(14.0F, 20.0F);
      tower.depth_m = 12.0F;
      tower.roof = RoofKind::kFlat;
      tower.walls = {WallKind::kPlain, WallKind::kBlind, WallKind::kNone, WallKind::kBlind};
      const ScopedFrame frame(scene.mesh, side.T_world_side * standing_at({x, 22.0F, 0.0F}, 0.0F));
      add_building(scene, tower);
    }
  }
}

}  // namespace

void add_blocks(Scene& scene, const CityPlan& plan, std::uint64_t seed) {
  SeededRandom random = SeededRandom::stream(seed, 23);
  const std::uint64_t terrace_seed = seed * 7 + 3;  // one terrace of equal houses for three streets
  for (int column = 0; column < CityPlan::kBlocks; ++column) {
    for (int row = 0; row < CityPlan::kBlocks; ++row) {
      const Eigen::AlignedBox2f kerb = plan.block(column, row);
      if (column == kParkColumn && row == kParkRow) {
        add_park(scene, kerb, random);
        continue;
      }
      const auto sides = CityPlan::sides(kerb);
      const auto block_seed =
          seed * 100 + static_cast<std::uint64_t>(CityPlan::kBlocks * column + row);
      const bool terrace_south = (column != 1 && row == 1);
      const bool terrace_north = (column == 2 && row == 0);
      add_row(scene, sides[0], true, terrace_south, terrace_south ? terrace_seed : block_seed * 4);
      add_row(scene, sides[2], true, terrace_north,
              terrace_north ? terrace_seed : block_seed * 4 + 2);
      add_short_side(scene, sides[1], random.chance(0.5), block_seed * 4 + 1);
      add_short_side(scene, sides[3], random.chance(0.5), block_seed * 4 + 3);
    }
  }
  std::uint64_t side_seed = seed * 1000 + 900;
  for (const StreetSide& side : plan.outer_sides()) {
    add_row(scene, side, false, false, ++side_seed);
  }
  add_skyline(scene, plan, seed);
}

}  // namespace km
