#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "apps/lab/simulation/world/buildings.hpp"
#include "apps/lab/simulation/world/objects.hpp"
#include "apps/lab/simulation/world/scene.hpp"
#include "apps/lab/simulation/world/streets.hpp"
#include "apps/lab/simulation/world/world.hpp"

namespace km {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;
using enum Recipe;

constexpr float kGate_m = 4.0F;
constexpr float kPath_m = 2.6F;

/// Railing or hedge along a side, open in the middle.
void add_boundary(Scene& scene, const StreetSide& side, bool hedge, SeededRandom& random) {
  const float half = 0.5F * (side.length_m - kGate_m);
  for (const float x : {0.3F, half + kGate_m}) {
    const auto frame = scene.at(side.T_world_side * standing_at({x, 0.3F, 0.0F}));
    if (hedge)
      add_hedge(scene, half - 0.3F, 0.8F, 1.1F, random);
    else
      add_railing(scene, half - 0.3F, 1.2F);
  }
  const auto stone = scene.paint(SurfaceClass::kFence, kStoneBlocks);
  const auto frame = scene.at(side.T_world_side);
  for (const float x : {half - 0.2F, half + kGate_m - 0.4F}) {
    scene.box({x, 0.0F, -0.2F}, {x + 0.6F, 0.6F, 1.7F}, stone, kSidesNoBottom);
    scene.box({x - 0.08F, -0.08F, 1.7F}, {x + 0.68F, 0.68F, 1.82F}, stone);
    scene.ellipsoid({x + 0.3F, 0.3F, 2.0F}, {0.22F, 0.22F, 0.22F}, 14, stone);
  }
}

/// A path in cells along x from 0 to `length`.
void add_path(Scene& scene, float length, MaterialId gravel) {
  const int cells = static_cast<int>(length / 2.0F);
  const auto point = [&](int row, float column) {
    return Vector3f(length * column / static_cast<float>(cells),
                    (row == 0 ? -0.5F : 0.5F) * kPath_m, 0.012F);
  };
  scene.sheet(1, cells, point, gravel);
}

/// A basin with a pillar and a figure.
void add_monument(Scene& scene, SeededRandom& random) {
  const Scene::Object object(scene);
  const auto stone = scene.paint(SurfaceClass::kObject, kConcrete, {0.95F, 0.92F, 0.85F});
  const auto water = scene.plain(SurfaceClass::kObject, {0.03F, 0.06F, 0.06F}, 0.5F);
  const Vector2f rim[] = {{2.6F, -0.1F}, {2.5F, 0.5F}, {2.6F, 0.55F}, {2.6F, 0.65F}, {2.3F, 0.65F}};
  scene.revolve(rim, 32, stone);
  scene.cylinder({0, 0, 0}, {0, 0, 0.52F}, 2.35F, 2.35F, 32, water);
  const Vector2f pillar[] = {{0.8F, 0.5F},  {0.7F, 0.9F}, {0.4F, 1.0F},  {0.3F, 1.6F},
                             {0.35F, 2.3F}, {0.6F, 2.5F}, {0.6F, 2.65F}, {0.0F, 2.7F}};
  scene.revolve(pillar, 20, stone);
  scene.at({0, 0, 2.68F}, random.uniform(0.0F, 2.0F * kPi)).add(add_person, random);
}

void add_park(Scene& scene, const Eigen::AlignedBox2f& kerb, SeededRandom& random) {
  const auto sides = CityPlan::sides(kerb);
  for (std::size_t i = 0; i < sides.size(); ++i) add_boundary(scene, sides[i], i % 2 == 0, random);
  const Vector2f centre = kerb.center();
  const auto middle = scene.at({centre.x(), centre.y(), kKerb_m});
  const float half_x = 0.5F * kerb.sizes().x() - kSidewalk_m;
  const float half_y = 0.5F * kerb.sizes().y() - kSidewalk_m;
  const auto gravel = scene.paint(SurfaceClass::kTerrain, kGravel);
  for (int arm = 0; arm < 4; ++arm) {
    const auto path = scene.at(Vector3f::Zero(), 0.5F * kPi * static_cast<float>(arm));
    add_path(scene, arm % 2 == 0 ? half_x : half_y, gravel);
    for (const float x : {5.5F, 9.0F}) scene.at({x, 0.5F * kPath_m + 0.5F, 0.0F}).add(add_bench);
    scene.at({7.2F, -0.5F * kPath_m - 0.5F, 0.0F}, kPi).add(add_street_lamp, random);
  }
  add_monument(scene, random);
  // Trees on a jittered grid, off the paths and the monument.
  for (float x = -half_x + 4.0F; x < half_x - 3.0F; x += 6.5F) {
    for (float y = -half_y + 3.5F; y < half_y - 2.5F; y += 6.0F) {
      const float px = x + random.uniform(-1.2F, 1.2F);
      const float py = y + random.uniform(-1.0F, 1.0F);
      const bool on_path = std::min(std::abs(px), std::abs(py)) < 2.2F;
      if (on_path || std::hypot(px, py) < 5.0F) continue;
      const auto at = scene.at({px, py, 0.0F}, random.uniform(0.0F, 6.0F));
      const int kind = random.below(5);
      if (kind <= 2) {
        add_tree(
            scene,
            {.height_m = random.uniform(6.5F, 10.0F), .crown_radius_m = random.uniform(2.2F, 3.0F)},
            random);
      } else if (kind == 3) {
        add_conifer(scene, random.uniform(5.0F, 8.0F), random);
      } else {
        add_bush(scene, random.uniform(0.7F, 1.3F), random);
      }
    }
  }
  for (int i = 0; i < 5; ++i) {
    const float along = random.uniform(4.0F, half_x - 1.0F) * random.sign();
    const auto at =
        scene.at({along, random.uniform(-0.9F, 0.9F), 0.0F}, random.uniform(0.0F, 6.0F));
    add_person(scene, random);
  }
}

constexpr float kHouseDepth_m = 11.0F;  // depth of the houses on the long sides
constexpr int kParkColumn = 1;
constexpr int kParkRow = 1;

/// Widths of lots that fill `length`, 9 to 14 m each, or all equal.
std::vector<float> lots(float length, bool equal, SeededRandom& random) {
  std::vector<float> widths;
  if (equal) {
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

/// The houses along one side; those at its ends have a facade to a second street.
void add_row(Scene& scene, const StreetSide& side, bool open_ends, bool terrace,
             std::uint64_t seed) {
  SeededRandom random = SeededRandom::stream(seed, 20);
  float x = 0.0F;
  const std::vector<float> widths = lots(side.length_m, terrace, random);
  for (std::size_t i = 0; i < widths.size(); ++i) {
    Building house = random_building(scene, terrace ? seed : seed + 1000 * (i + 1));
    house.width_m = widths[i];
    house.depth_m = kHouseDepth_m;
    const bool first = i == 0;
    const bool last = i + 1 == widths.size();
    house.walls = {WallKind::kRich, last && open_ends ? WallKind::kRich : WallKind::kBlind,
                   open_ends ? WallKind::kPlain : WallKind::kNone,
                   first && open_ends ? WallKind::kRich : WallKind::kBlind};
    const auto frame = scene.at(side.T_world_side * standing_at({x, 0.0F, 0.0F}));
    add_building(scene, house);
    x += widths[i];
  }
}

/// A gap between rows: a fenced garden with a tree and bushes.
void add_garden(Scene& scene, const StreetSide& side, SeededRandom& random) {
  const auto frame = scene.at(side.T_world_side);
  const float length = side.length_m;
  {
    const auto line = scene.at({0.0F, 0.1F, 0.0F});
    const int kind = random.below(3);
    if (kind == 0) add_railing(scene, length, 1.5F);
    if (kind == 1) add_plank_fence(scene, length, 1.8F);
    if (kind == 2) add_hedge(scene, length, 0.7F, 1.5F, random);
  }
  const float deep = 7.0F;
  for (const float x : {0.3F * length, 0.75F * length}) {
    scene.at({x, random.uniform(2.8F, deep), 0.0F})
        .add(add_tree, TreeShape{.height_m = random.uniform(6.0F, 8.5F)}, random);
  }
  for (int i = 0; i < 4; ++i) {
    const auto at =
        scene.at({random.uniform(1.0F, length - 1.0F), random.uniform(1.5F, deep), 0.0F});
    add_bush(scene, random.uniform(0.5F, 0.9F), random);
  }
}

/// A short side between the two rows of a block: a house or a garden.
void add_short_side(Scene& scene, StreetSide side, bool garden, std::uint64_t seed) {
  side.T_world_side = side.T_world_side * standing_at({kHouseDepth_m, 0.0F, 0.0F});
  side.length_m -= 2.0F * kHouseDepth_m;
  if (garden) {
    SeededRandom random = SeededRandom::stream(seed, 21);
    add_garden(scene, side, random);
    return;
  }
  Building house = random_building(scene, seed);
  house.width_m = side.length_m;
  house.depth_m = 9.0F;
  house.walls = {WallKind::kRich, WallKind::kBlind, WallKind::kNone, WallKind::kBlind};
  scene.at(side.T_world_side).add(add_building, house);
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
      tower.ridge = false;
      tower.walls = {WallKind::kPlain, WallKind::kBlind, WallKind::kNone, WallKind::kBlind};
      scene.at(side.T_world_side * standing_at({x, 22.0F, 0.0F})).add(add_building, tower);
    }
  }
}

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
      const bool terrace_south = column != 1 && row == 1;
      const bool terrace_north = column == 2 && row == 0;
      add_row(scene, sides[0], true, terrace_south, terrace_south ? terrace_seed : block_seed * 4);
      add_row(scene, sides[2], true, terrace_north,
              terrace_north ? terrace_seed : block_seed * 4 + 2);
      for (const std::size_t side : {1U, 3U})
        add_short_side(scene, sides[side], random.chance(0.5), block_seed * 4 + side);
    }
  }
  std::uint64_t side_seed = seed * 1000 + 900;
  for (const StreetSide& side : plan.outer_sides()) add_row(scene, side, false, false, ++side_seed);
  add_skyline(scene, plan, seed);
}

constexpr float kParking_m = -kSidewalk_m - 1.05F;  // middle of the parking lane, y of a side
constexpr float kAtKerb_m = -kSidewalk_m + 0.65F;   // position of poles and trees
constexpr float kAtWall_m = -0.45F;
constexpr float kBay_m = 5.4F;
constexpr float kClearOfCorner_m = 4.6F;

void add_parked_vehicles(Scene& scene, const StreetSide& side, SeededRandom& random) {
  const double occupied = random.uniform(0.4F, 0.9F);
  const float half = 0.5F * kBay_m;
  for (float x = kClearOfCorner_m + half; x < side.length_m - kClearOfCorner_m - half;
       x += kBay_m) {
    if (!random.chance(occupied)) continue;
    const int draw = random.below(10);
    const VehicleKind kind = draw < 3   ? VehicleKind::kSedan
                             : draw < 7 ? VehicleKind::kHatchback
                             : draw < 9 ? VehicleKind::kEstate
                                        : VehicleKind::kVan;
    const float askew = random.uniform(-0.025F, 0.025F);
    const Vector3f at(x + random.uniform(-0.15F, 0.15F), kParking_m + random.uniform(0.0F, 0.12F),
                      -kKerb_m);
    scene.at(at, kPi + askew).add(add_vehicle, kind, random);
  }
}

void add_small_object(Scene& scene, SeededRandom& random) {
  using AddObject = void (*)(Scene&, SeededRandom&);
  constexpr AddObject kNothing = [](Scene&, SeededRandom&) {};
  constexpr AddObject kBollard = [](Scene& s, SeededRandom&) { add_bollard(s); };
  constexpr AddObject kHydrant = [](Scene& s, SeededRandom&) { add_hydrant(s); };
  constexpr AddObject kTurnedSign = [](Scene& s, SeededRandom& r) {
    s.at(Vector3f::Zero(), 0.5F * kPi).add(add_traffic_sign, r);
  };
  constexpr AddObject kObjects[] = {add_bin,  kHydrant,    add_mail_box, add_planter, kBollard,
                                    kBollard, kTurnedSign, kNothing,     kNothing};
  random.pick(kObjects)(scene, random);
}

void add_along_kerb(Scene& scene, const StreetSide& side, SeededRandom& random) {
  const bool trees = random.chance(0.6);
  const float first = random.uniform(2.0F, 4.0F);
  int slot = 0;
  for (float x = first; x < side.length_m - 1.0F; x += 2.1F, ++slot) {
    const auto at = scene.at({x, kAtKerb_m, 0.0F});
    if (slot % 8 == 1) {
      add_street_lamp(scene, random);
    } else if (trees && slot % 4 == 3) {
      if (random.chance(0.2)) continue;
      scene.at(Vector3f::Zero(), random.uniform(0.0F, 6.0F))
          .add(add_tree,
               TreeShape{
                   .height_m = random.uniform(5.5F, 7.5F), .crown_radius_m = 1.9F, .leaves = 1100},
               random);
    } else if (slot % 2 == 0 && random.chance(0.6)) {
      add_small_object(scene, random);
    }
  }
  const float column_x = random.uniform(0.3F, 0.7F) * side.length_m;
  if (random.chance(0.15))
    scene.at({column_x, kAtWall_m - 0.5F, 0.0F}).add(add_advertising_column, random);
}

void add_along_wall(Scene& scene, const StreetSide& side, SeededRandom& random) {
  for (float x = random.uniform(2.0F, 8.0F); x < side.length_m - 2.0F;
       x += random.uniform(5.0F, 11.0F)) {
    const auto at = scene.at({x, kAtWall_m, 0.0F});
    if (random.chance(0.35))
      add_bin(scene, random);
    else if (random.chance(0.4))
      add_bench(scene);
    else if (random.chance(0.4))
      add_planter(scene, random);
  }
  for (float x = random.uniform(1.0F, 14.0F); x < side.length_m; x += random.uniform(6.0F, 18.0F)) {
    const Vector3f at(x, random.uniform(-1.7F, -1.0F), 0.0F);
    scene.at(at, random.uniform(0.0F, 2.0F * kPi)).add(add_person, random);
  }
}

void add_at_corner(Scene& scene, SeededRandom& random) {
  // Traffic on this side drives along -x: its light stands at x = 0 and faces +x.
  const auto light = scene.at({0.4F, -kSidewalk_m + 0.4F, 0.0F}, 0.5F * kPi);
  add_traffic_light(scene);
  const auto back = scene.at({-1.2F, 0.0F, 0.0F});
  if (random.chance(0.5)) add_traffic_sign(scene, random);
}

void add_sidewalk_objects(Scene& scene, const StreetSide& side, SeededRandom& random) {
  const auto frame = scene.at(side.T_world_side);
  add_parked_vehicles(scene, side, random);
  add_along_kerb(scene, side, random);
  add_along_wall(scene, side, random);
  add_at_corner(scene, random);
}

/// Moves everything vertically with the ground, so that walls stay upright.
void follow_ground(SurfaceMesh& mesh, const CityPlan& plan) {
  for (Eigen::Vector3f& p : mesh.vertices) p.z() += static_cast<float>(plan.ground(p.x(), p.y()));
}

Lighting daylight(std::uint64_t seed) {
  SeededRandom random = SeededRandom::stream(seed, 30);
  const float azimuth = random.uniform(0.0F, 6.28F);
  const float elevation = random.uniform(0.75F, 1.0F);
  Lighting lighting;
  lighting.to_sun = {std::cos(elevation) * std::cos(azimuth),
                     std::cos(elevation) * std::sin(azimuth), std::sin(elevation)};
  lighting.to_sun.normalize();
  lighting.sun = 0.8F;
  lighting.ambient = 0.32F;
  lighting.haze_distance_m = 900.0F;
  return lighting;
}

}  // namespace

World make_city(std::uint64_t seed) {
  const CityPlan plan = make_city_plan(seed);
  Scene scene(seed);
  SeededRandom random = SeededRandom::stream(seed, 31);
  add_streets(scene, plan, random);
  add_blocks(scene, plan, seed);
  for (int column = 0; column < CityPlan::kBlocks; ++column) {
    for (int row = 0; row < CityPlan::kBlocks; ++row)
      for (const StreetSide& side : CityPlan::sides(plan.block(column, row)))
        add_sidewalk_objects(scene, side, random);
  }
  for (const StreetSide& side : plan.outer_pieces()) add_sidewalk_objects(scene, side, random);

  World world;
  world.name = "city";
  scene.move_to(world);
  follow_ground(world.mesh, plan);
  world.lighting = daylight(seed);
  world.ground_height = [plan](double x, double y) { return plan.ground(x, y); };
  world.routes = city_routes(plan);
  return world;
}

}  // namespace km
