#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "modules/simulation/world/room_floor.hpp"
#include "modules/simulation/world/room_furniture.hpp"
#include "modules/simulation/world/room_walls.hpp"
#include "modules/simulation/world/scene.hpp"
#include "modules/simulation/world/world.hpp"

namespace km {
namespace {

using Eigen::Isometry3f;
using Eigen::Vector3f;

constexpr float kPi = 3.14159265F;

// The flights of V1_01 to V2_03 fill x -3.79 to 2.30, y -2.45 to 3.47, z 0.63 to 2.92 m. Walls
// stand at least 0.8 m off; what is higher than 0.5 m keeps to the outer 0.55 m.
constexpr float kEdge_m = 8.0F;
constexpr float kHeight_m = 4.0F;
const Vector3f kCorner(-4.6F, -3.5F, 0.0F);
constexpr float kHalf_m = 0.5F * kEdge_m;

/// The stretch of a wall whose middle is at x, to put things before it.
Isometry3f at_wall(float x) {
  return standing_at({x, 0.0F, 0.0F}, 0.0F);
}

/// Mattresses on both sides of a window, a radiator below it, a checkerboard.
void furnish_mattress_wall(Scene& scene, SeededRandom& random) {
  const WallWindow window{random.uniform(1.6F, 1.9F), 1.5F, 0.9F, 2.9F};
  add_wall(scene, kEdge_m, kHeight_m, &window, random);
  {
    const ScopedFrame scope(scene.mesh, at_wall(window.center_m));
    add_radiator(scene, 1.3F);
  }
  for (float x = -2.9F; x < 0.8F; x += random.uniform(1.05F, 1.2F)) {
    const ScopedFrame scope(scene.mesh, at_wall(x));
    add_leaning_mattress(scene, {1.0F, 0.17F, random.uniform(1.9F, 2.1F)},
                         random.uniform(0.12F, 0.3F), random);
  }
  const MaterialId checker =
      scene.paint(SurfaceClass::kObject, Recipe::kChecker, Vector3f::Ones(), 0.64F);
  const MaterialId white = scene.plain(SurfaceClass::kObject, 0.8F, 0.8F, 0.8F);
  const ScopedFrame scope(scene.mesh,
                          standing_at({random.uniform(-0.8F, 0.2F), -0.53F, 0.0F}, 0.0F));
  add_board(scene, 0.48F, 0.64F, 0.12F, checker, white);
}

/// A sheet with a print of boards, foam, a leaning mattress, a shelf.
void furnish_plank_wall(Scene& scene, SeededRandom& random) {
  add_wall(scene, kEdge_m, kHeight_m, nullptr, random);
  {
    const ScopedFrame scope(scene.mesh, at_wall(random.uniform(-0.3F, 0.3F)));
    add_plank_sheet(scene, 3.3F, 2.5F);
  }
  {
    const ScopedFrame scope(scene.mesh, at_wall(2.5F));
    add_foam_panel(scene, 1.0F, 1.15F);
  }
  {
    const ScopedFrame scope(scene.mesh, at_wall(-2.6F));
    add_leaning_mattress(scene, {1.5F, 0.17F, 0.9F}, 0.2F, random);
  }
  {
    const ScopedFrame scope(scene.mesh, at_wall(3.4F));
    add_shelf(scene, 0.8F, 1.75F, random);
  }
  for (const float x : {-2.9F, -2.2F, 2.4F}) {
    const ScopedFrame scope(scene.mesh, at_wall(x));
    add_poster(scene, random.chance(0.5) ? 0.6F : 0.45F, random.uniform(1.6F, 2.0F), random);
  }
  const ScopedFrame scope(scene.mesh, standing_at({-3.5F, -0.25F, 0.0F}, 0.0F));
  add_stand(scene, 2.1F, random);
}

/// A window behind a mattress, a ladder, posters, a heavy curtain.
void furnish_window_wall(Scene& scene, SeededRandom& random) {
  const WallWindow window{random.uniform(0.9F, 1.3F), 1.7F, 0.9F, 2.95F};
  add_wall(scene, kEdge_m, kHeight_m, &window, random);
  {
    const ScopedFrame scope(scene.mesh, at_wall(window.center_m));
    add_leaning_mattress(scene, {2.0F, 0.17F, 0.95F}, 0.25F, random);
  }
  {
    const ScopedFrame scope(scene.mesh, at_wall(2.7F));
    add_leaning_mattress(scene, {0.9F, 0.17F, 1.95F}, 0.2F, random);
  }
  {
    const ScopedFrame scope(scene.mesh, at_wall(random.uniform(-0.8F, -0.4F)));
    add_ladder(scene, 2.5F);
  }
  for (const float x : {-1.7F, -2.4F}) {
    const ScopedFrame scope(scene.mesh, at_wall(x));
    add_poster(scene, random.chance(0.5) ? 0.6F : 0.45F, random.uniform(1.4F, 1.8F), random);
  }
  const ScopedFrame scope(scene.mesh, at_wall(-3.3F));
  add_curtain(scene, 1.2F, 2.8F, random);
}

/// Desks, chairs, cartons and a cabinet: where the operators sit.
void furnish_desk_wall(Scene& scene, SeededRandom& random) {
  add_wall(scene, kEdge_m, kHeight_m, nullptr, random);
  {
    const ScopedFrame scope(scene.mesh, at_wall(-2.6F));
    add_desk(scene, random);
  }
  {
    const ScopedFrame scope(scene.mesh, at_wall(random.uniform(0.4F, 0.7F)));
    add_table(scene, 1.5F, 0.5F, 6, random);
  }
  {
    const ScopedFrame scope(scene.mesh, at_wall(2.4F));
    add_shelf(scene, 1.2F, 1.9F, random);
  }
  for (const float x : {-1.4F, -0.8F}) {
    const ScopedFrame scope(scene.mesh,
                            standing_at({x, -0.3F, 0.0F}, random.uniform(-0.25F, 0.25F)));
    add_chair(scene, random);
  }
  for (float x = 0.0F; x < 1.3F; x += 0.45F) {  // below the table
    const ScopedFrame scope(scene.mesh,
                            standing_at({x, -0.25F, 0.0F}, random.uniform(-0.2F, 0.2F)));
    add_carton(scene, {0.38F, 0.3F, random.uniform(0.2F, 0.36F)}, random);
  }
  for (const float x : {-3.0F, -2.0F, -0.3F, 0.9F}) {
    const ScopedFrame scope(scene.mesh, at_wall(x));
    add_poster(scene, random.uniform(0.4F, 0.8F), random.uniform(1.6F, 2.1F), random);
  }
  const ScopedFrame scope(scene.mesh, standing_at({3.6F, -0.3F, 0.0F}, 0.0F));
  add_bucket(scene, random);
}

/// What stands free, lower than any flight.
void furnish_middle(Scene& scene, SeededRandom& random) {
  const float x = kHalf_m + random.uniform(0.6F, 1.2F);
  const float y = kHalf_m + random.uniform(0.9F, 1.4F);
  const Isometry3f stack = standing_at({x, y, 0.0F}, random.uniform(-0.3F, 0.3F));
  const ScopedFrame scope(scene.mesh, stack);
  add_mattress_stack(scene, 3, random);
  {
    const MaterialId tags =
        scene.paint(SurfaceClass::kObject, Recipe::kTagGrid, Vector3f::Constant(1.15F), 0.78F);
    const MaterialId white = scene.plain(SurfaceClass::kObject, 0.8F, 0.8F, 0.8F);
    const ScopedFrame board(scene.mesh, standing_at({-0.5F, -1.05F, 0.0F}, 0.0F));
    add_board(scene, 0.78F, 0.78F, 0.95F, tags, white);
  }
  for (int i = 0; i < 4; ++i) {
    const float angle = random.uniform(-0.6F, 0.6F);
    const Vector3f at(1.35F + random.uniform(0.0F, 0.5F), -0.9F + 0.6F * static_cast<float>(i),
                      0.0F);
    const ScopedFrame carton(scene.mesh, standing_at(at, angle));
    const float width = random.uniform(0.4F, 0.7F);
    add_carton(scene, {width, 0.35F, random.uniform(0.22F, 0.4F)}, random);
  }
}

}  // namespace

World make_vicon_room(std::uint64_t seed) {
  Scene scene(seed);
  SeededRandom random(seed);
  const Isometry3f T_world_room(Eigen::Translation3f(kCorner.x(), kCorner.y(), kCorner.z()));
  World world;
  world.name = "vicon_room";
  {
    const ScopedFrame room(scene.mesh, T_world_room);
    add_room_floor(scene, kEdge_m, kEdge_m, random);
    for (const Vector3f& lamp : add_ceiling(scene, kEdge_m, kEdge_m, kHeight_m, random)) {
      world.lighting.lamps.push_back({T_world_room * lamp, 1.3F});
    }
    furnish_middle(scene, random);
  }
  // East, south, west and north, if not turned; each seed turns the room by a quarter more.
  using Furnish = void (*)(Scene&, SeededRandom&);
  constexpr std::array<Furnish, 4> kWalls = {furnish_mattress_wall, furnish_plank_wall,
                                             furnish_desk_wall, furnish_window_wall};
  constexpr std::array<bool, 4> kHasWindow = {true, false, false, true};
  const auto turns = static_cast<std::size_t>((seed + 3) % 4);
  for (std::size_t i = 0; i < kWalls.size(); ++i) {
    const float yaw = -0.5F * kPi * static_cast<float>((i + turns + 1) % 4);  // east: -y to -x
    const Vector3f middle = kCorner + Vector3f(kHalf_m, kHalf_m, 0.0F);
    const Isometry3f wall = standing_at(middle, yaw) * Eigen::Translation3f(0.0F, kHalf_m, 0.0F);
    const ScopedFrame scope(scene.mesh, wall);
    kWalls[i](scene, random);
    if (kHasWindow[i]) {
      world.lighting.lamps.push_back({wall * Vector3f(1.4F, -1.3F, 2.3F), 1.6F});
    }
  }
  world.lighting.ambient = 0.25F;
  world.flight_volume =
      Eigen::AlignedBox3d(Eigen::Vector3d(-3.9, -2.6, 0.8), Eigen::Vector3d(2.5, 3.6, 2.95));
  world.mesh = scene.mesh.take();
  scene.library.move_to(world);
  return world;
}

}  // namespace km
