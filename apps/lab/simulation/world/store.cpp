#include <array>

#include "apps/lab/simulation/world/objects.hpp"
#include "apps/lab/simulation/world/places.hpp"
#include "apps/lab/simulation/world/routes.hpp"
#include "apps/lab/simulation/world/scene.hpp"
#include "apps/lab/simulation/world/world.hpp"

namespace km {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3f;
using enum Recipe;

constexpr int kAisles = 5;          // between the rows of shelves and the walls
constexpr float kAisle_m = 2.4F;    // from one row of shelves to the next
constexpr float kRow_m = 0.8F;      // depth of two shelves, back to back
constexpr float kLength_m = 14.0F;  // length of a row, along x
constexpr float kEnd_m = 3.0F;      // free space beyond the ends of rows
constexpr float kCeiling_m = 4.0F;
constexpr float kUnit_m = 2.0F;  // width of a shelf
constexpr double kPace_mps = 1.2;

constexpr float aisle_y(int aisle) {
  return (static_cast<float>(aisle) + 0.5F) * kAisle_m + static_cast<float>(aisle) * kRow_m;
}

constexpr float kHallDepth_m = aisle_y(kAisles - 1) + 0.5F * kAisle_m;

void add_hall(Scene& scene) {
  const Vector3f low(-kEnd_m, 0.0F, 0.0F), high(kLength_m + kEnd_m, kHallDepth_m, kCeiling_m);
  const auto floor = scene.paint(SurfaceClass::kFloor, kConcrete, {0.75F, 0.75F, 0.72F});
  const auto wall = scene.paint(SurfaceClass::kWall, kPlaster, {0.8F, 0.8F, 0.76F});
  const auto ceiling = scene.paint(SurfaceClass::kCeiling, kPlaster);
  scene.quad({low.x(), low.y(), 0}, {high.x(), low.y(), 0}, {high.x(), high.y(), 0},
             {low.x(), high.y(), 0}, floor);
  scene.quad({low.x(), high.y(), kCeiling_m}, {high.x(), high.y(), kCeiling_m},
             {high.x(), low.y(), kCeiling_m}, {low.x(), low.y(), kCeiling_m}, ceiling);
  scene.quad({low.x(), low.y(), 0}, {low.x(), high.y(), 0}, {low.x(), high.y(), kCeiling_m},
             {low.x(), low.y(), kCeiling_m}, wall);
  scene.quad({high.x(), high.y(), 0}, {high.x(), low.y(), 0}, {high.x(), low.y(), kCeiling_m},
             {high.x(), high.y(), kCeiling_m}, wall);
  scene.quad({high.x(), low.y(), 0}, {low.x(), low.y(), 0}, {low.x(), low.y(), kCeiling_m},
             {high.x(), low.y(), kCeiling_m}, wall);
  scene.quad({low.x(), high.y(), 0}, {high.x(), high.y(), 0}, {high.x(), high.y(), kCeiling_m},
             {low.x(), high.y(), kCeiling_m}, wall);
}

// Both sides of a row; each shelf has the same goods in the same order.
void add_row_of_shelves(Scene& scene, float y, std::uint64_t seed) {
  for (float x = 0.5F * kUnit_m; x < kLength_m; x += kUnit_m) {
    for (const float side : {0.0F, 3.14159265F}) {
      SeededRandom goods = SeededRandom::stream(seed, 60);
      scene.at({x, y, 0.0F}, side).add(add_shelf, kUnit_m - 0.1F, 2.2F, goods);
    }
  }
}

// Down one aisle and back along another.
Route loop(int there, int back) {
  const double left = -0.5 * static_cast<double>(kEnd_m),
               right = static_cast<double>(kLength_m) - left;
  const double y0 = static_cast<double>(aisle_y(there)), y1 = static_cast<double>(aisle_y(back));
  return {{{left, y0}, {right, y0}, {right, y1}, {left, y1}}, kPace_mps};
}

}  // namespace

World make_store(std::uint64_t seed) {
  Scene scene(seed);
  add_hall(scene);
  for (int row = 0; row + 1 < kAisles; ++row)
    add_row_of_shelves(scene, aisle_y(row) + 0.5F * (kAisle_m + kRow_m), seed);
  World world;
  world.name = "store";
  scene.move_to(world);
  world.lighting.ambient = 0.35F;
  for (const float x : {0.2F, 0.8F})
    for (int aisle = 0; aisle < kAisles; ++aisle)
      world.lighting.lamps.push_back({{x * kLength_m, aisle_y(aisle), kCeiling_m - 0.3F}, 2.5F});
  world.routes = {loop(0, 1), loop(1, 2), loop(3, 1), loop(4, 2)};
  return world;
}

}  // namespace km
