#include "modules/simulation/world/building.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace km {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

void add_parapet(Scene& scene, const Building& b, float z) {
  MeshBuilder& mesh = scene.mesh;
  const float top = z + 0.55F;
  const float thick = 0.25F;
  const auto run = [&](const Vector3f& low, const Vector3f& high) {
    mesh.box(low, {high.x(), high.y(), top}, b.style.wall, kSidesAround);
    mesh.box({low.x() - 0.04F, low.y() - 0.04F, top},
             {high.x() + 0.04F, high.y() + 0.04F, top + 0.08F}, b.style.trim, kSidesAll);
  };
  run({0, 0, z}, {b.width_m, thick, top});
  run({0, b.depth_m - thick, z}, {b.width_m, b.depth_m, top});
  run({0, thick, z}, {thick, b.depth_m - thick, top});
  run({b.width_m - thick, thick, z}, {b.width_m, b.depth_m - thick, top});
}

void add_flat_roof(Scene& scene, const Building& b, SeededRandom& random) {
  MeshBuilder& mesh = scene.mesh;
  const float z = height_m(b.style);
  mesh.quad({0, 0, z}, {b.width_m, 0, z}, {b.width_m, b.depth_m, z}, {0, b.depth_m, z}, b.roofing);
  add_parapet(scene, b, z);
  const MaterialId metal =
      scene.paint(SurfaceClass::kBuilding, Recipe::kPaintedMetal, {0.5F, 0.5F, 0.5F});
  const int machines = 1 + random.below(3);
  for (int i = 0; i < machines; ++i) {
    const float x = random.uniform(1.0F, std::max(1.1F, b.width_m - 3.0F));
    const float y = random.uniform(1.5F, std::max(1.6F, b.depth_m - 3.0F));
    const Vector3f size(random.uniform(1.0F, 2.5F), random.uniform(1.0F, 2.0F),
                        random.uniform(0.8F, 2.2F));
    mesh.box({x, y, z},
             {std::min(x + size.x(), b.width_m - 0.5F), std::min(y + size.y(), b.depth_m - 0.5F),
              z + size.z()},
             metal, kSidesNoBottom);
  }
}

void add_chimney(Scene& scene, const Building& b, float x, float ridge) {
  const MaterialId brick = scene.paint(SurfaceClass::kBuilding, Recipe::kBrick);
  const MaterialId pot = scene.plain(SurfaceClass::kBuilding, 0.4F, 0.18F, 0.1F);
  const float y = 0.5F * b.depth_m + 0.4F;
  scene.mesh.box({x, y, ridge - 1.5F}, {x + 0.9F, y + 0.6F, ridge + 0.9F}, brick, kSidesNoBottom);
  for (const float dx : {0.25F, 0.65F}) {
    scene.mesh.cylinder({x + dx, y + 0.3F, ridge + 0.9F}, {x + dx, y + 0.3F, ridge + 1.25F}, 0.12F,
                        0.1F, 8, pot);
  }
}

void add_dormer(Scene& scene, const Building& b, float x, float z, float slope) {
  MeshBuilder& mesh = scene.mesh;
  const float y = 0.9F;  // behind the wall
  const float base = z + y * slope;
  const float half = 0.75F;
  const float top = base + 1.5F;
  const float back = y + 1.5F / slope;
  const auto& style = b.style;
  const MaterialId glass = scene.plain(SurfaceClass::kBuilding, 0.05F, 0.055F, 0.06F, 0.45F);
  mesh.quad({x - half, y, base}, {x + half, y, base}, {x + half, y, top}, {x - half, y, top},
            style.trim);
  mesh.quad({x - 0.5F, y - 0.01F, base + 0.25F}, {x + 0.5F, y - 0.01F, base + 0.25F},
            {x + 0.5F, y - 0.01F, top - 0.2F}, {x - 0.5F, y - 0.01F, top - 0.2F}, glass);
  mesh.box({x - 0.03F, y - 0.04F, base + 0.25F}, {x + 0.03F, y - 0.01F, top - 0.2F}, style.frame,
           kSidesNoBack);
  mesh.triangle({x - half, back, top}, {x - half, y, base}, {x - half, y, top}, style.wall);
  mesh.triangle({x - half, back, top}, {x - half, y, top}, {x - half, y, base}, style.wall);
  mesh.triangle({x + half, y, base}, {x + half, back, top}, {x + half, y, top}, style.wall);
  mesh.box({x - half - 0.15F, y - 0.25F, top}, {x + half + 0.15F, back, top + 0.12F}, b.roofing);
}

void add_ridge_roof(Scene& scene, const Building& b, SeededRandom& random) {
  MeshBuilder& mesh = scene.mesh;
  const float z = height_m(b.style);
  const float slope = std::tan(random.uniform(0.6F, 0.85F));
  const float eave = 0.4F;
  const float middle = 0.5F * b.depth_m;
  const float ridge = z + slope * middle;
  const float low = z - slope * eave;
  const float w = b.width_m;
  const float d = b.depth_m;
  mesh.quad({0, -eave, low}, {w, -eave, low}, {w, middle, ridge}, {0, middle, ridge}, b.roofing);
  mesh.quad({w, d + eave, low}, {0, d + eave, low}, {0, middle, ridge}, {w, middle, ridge},
            b.roofing);
  mesh.quad({w, -eave, low - 0.02F}, {0, -eave, low - 0.02F}, {0, 0, z - 0.02F}, {w, 0, z - 0.02F},
            b.style.trim);  // soffit
  mesh.triangle({0, d, z}, {0, 0, z}, {0, middle, ridge}, b.style.wall);
  mesh.triangle({w, 0, z}, {w, d, z}, {w, middle, ridge}, b.style.wall);
  const MaterialId zinc = scene.plain(SurfaceClass::kBuilding, 0.3F, 0.32F, 0.33F, 0.05F);
  mesh.cylinder({0, -eave - 0.06F, low}, {w, -eave - 0.06F, low}, 0.08F, 0.08F, 8, zinc);
  add_chimney(scene, b, random.uniform(0.1F, 0.8F) * w, ridge);
  if (random.chance(0.6)) {
    const int dormers = std::max(1, static_cast<int>(w / 3.6F));
    for (int i = 0; i < dormers; ++i) {
      add_dormer(scene, b, w * (static_cast<float>(i) + 0.5F) / static_cast<float>(dormers), z,
                 slope);
    }
  }
}

void add_wall(Scene& scene, const Building& b, WallKind kind, float width_m) {
  if (kind == WallKind::kRich) add_facade(scene, b.style, width_m);
  if (kind == WallKind::kPlain) add_plain_facade(scene, b.style, width_m, false);
  if (kind == WallKind::kBlind) add_plain_facade(scene, b.style, width_m, true);
}

void choose_walls(Scene& scene, FacadeStyle& style, SeededRandom& random) {
  constexpr SurfaceClass kLabel = SurfaceClass::kBuilding;
  const int kind = random.below(10);
  const float light = 0.1F * static_cast<float>(random.below(3));
  if (kind <= 2) {
    const float red = 0.8F + light;
    style.wall = scene.paint(kLabel, Recipe::kBrick, {red, 0.9F * red, 0.85F * red});
    style.base = random.chance(0.4) ? scene.paint(kLabel, Recipe::kStoneBlocks) : style.wall;
  } else if (kind <= 7) {
    static constexpr std::array<std::array<float, 3>, 8> kTints = {{{0.72F, 0.6F, 0.36F},
                                                                    {0.7F, 0.68F, 0.62F},
                                                                    {0.62F, 0.38F, 0.28F},
                                                                    {0.45F, 0.5F, 0.42F},
                                                                    {0.42F, 0.5F, 0.58F},
                                                                    {0.74F, 0.66F, 0.55F},
                                                                    {0.52F, 0.5F, 0.48F},
                                                                    {0.68F, 0.5F, 0.42F}}};
    const auto& [red, green, blue] = kTints[static_cast<std::size_t>(random.below(kTints.size()))];
    style.wall = scene.paint(kLabel, Recipe::kPlaster, {red, green, blue});
    style.base = random.chance(0.5) ? scene.paint(kLabel, Recipe::kPlaster,
                                                  {0.4F + light, 0.38F + light, 0.36F + light})
                                    : style.wall;
  } else if (kind == 8) {
    style.wall = scene.paint(kLabel, Recipe::kStoneBlocks, {0.9F, 0.88F, 0.82F});
    style.base = style.wall;
  } else {
    style.wall = scene.paint(kLabel, Recipe::kConcrete, {1.0F, 1.0F, 0.97F});
    style.base = style.wall;
  }
}

}  // namespace

void add_building(Scene& scene, const Building& b) {
  const float w = b.width_m;
  const float d = b.depth_m;
  const std::array<Vector3f, 4> corners = {
      {{0.0F, 0.0F, 0.0F}, {w, 0.0F, 0.0F}, {w, d, 0.0F}, {0.0F, d, 0.0F}}};
  SeededRandom random = SeededRandom::stream(b.style.seed, 3);
  scene.mesh.set_uv_offset({random.uniform(0.0F, 7.0F), random.uniform(0.0F, 7.0F)});
  for (int side = 0; side < 4; ++side) {
    const auto i = static_cast<std::size_t>(side);
    const float yaw = 0.5F * std::numbers::pi_v<float> * static_cast<float>(side);
    const ScopedFrame frame(scene.mesh, standing_at(corners[i], yaw));
    add_wall(scene, b, b.walls[i], side % 2 == 0 ? w : d);
  }
  if (b.roof == RoofKind::kFlat) {
    add_flat_roof(scene, b, random);
  } else {
    add_ridge_roof(scene, b, random);
  }
  scene.mesh.set_uv_offset(Vector2f::Zero());
}

Building random_building(Scene& scene, std::uint64_t seed) {
  SeededRandom random = SeededRandom::stream(seed, 4);
  Building b;
  FacadeStyle& style = b.style;
  style.seed = seed;
  choose_walls(scene, style, random);
  constexpr SurfaceClass kLabel = SurfaceClass::kBuilding;
  const float stone = random.uniform(0.0F, 1.0F) < 0.6F ? 0.9F : 0.6F;
  style.trim = scene.paint(kLabel, Recipe::kConcrete, {stone, 0.98F * stone, 0.93F * stone});
  style.frame = random.chance(0.7) ? scene.plain(kLabel, 0.75F, 0.75F, 0.72F)
                                   : scene.plain(kLabel, 0.16F, 0.1F, 0.06F);
  static constexpr std::array<std::array<float, 3>, 5> kDoors = {{{0.1F, 0.2F, 0.12F},
                                                                  {0.25F, 0.06F, 0.05F},
                                                                  {0.08F, 0.12F, 0.25F},
                                                                  {0.28F, 0.17F, 0.09F},
                                                                  {0.2F, 0.22F, 0.24F}}};
  const auto& [red, green, blue] = kDoors[static_cast<std::size_t>(random.below(kDoors.size()))];
  style.shutter = scene.paint(kLabel, Recipe::kPaintedMetal, {red, green, blue});
  style.floors = 3 + random.below(3);
  style.ground_floor_m = random.uniform(3.5F, 4.2F);
  style.floor_m = random.uniform(2.9F, 3.3F);
  style.bay_m = random.uniform(2.1F, 3.1F);
  style.window_width_m = random.uniform(0.95F, 1.3F);
  style.window_height_m = random.uniform(1.45F, 1.8F);
  style.recess_m = random.uniform(0.1F, 0.24F);
  style.window = random.chance(0.55)  ? WindowKind::kCasement
                 : random.chance(0.5) ? WindowKind::kSash
                                      : WindowKind::kPane;
  style.ground_floor = random.chance(0.45)   ? GroundFloor::kShops
                       : random.chance(0.15) ? GroundFloor::kGarages
                                             : GroundFloor::kWindows;
  style.surrounds = random.chance(0.4);
  style.shutters = !style.surrounds && style.bay_m > 2.5F && random.chance(0.45);
  style.balconies = random.chance(0.3);
  style.string_courses = random.chance(0.6);
  style.cornice = random.chance(0.7);
  style.downpipe = random.chance(0.8);
  b.roof = random.chance(0.55) ? RoofKind::kRidge : RoofKind::kFlat;
  b.roofing = b.roof == RoofKind::kRidge
                  ? scene.paint(kLabel, Recipe::kRoofTiles, {0.8F + 0.2F * stone, 0.9F, 0.9F})
                  : scene.paint(kLabel, Recipe::kGravel, {0.8F, 0.8F, 0.8F});
  return b;
}

}  // namespace km
