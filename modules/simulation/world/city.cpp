#include <cmath>

#include "modules/simulation/world/city_blocks.hpp"
#include "modules/simulation/world/city_plan.hpp"
#include "modules/simulation/world/scene.hpp"
#include "modules/simulation/world/streets.hpp"
#include "modules/simulation/world/world.hpp"

namespace km {
namespace {

/// Bends everything along with the ground: up and down only, walls stay upright.
void follow_ground(SurfaceMesh& mesh, const CityPlan& plan) {
  for (Eigen::Vector3f& p : mesh.vertices) {
    p.z() += static_cast<float>(plan.ground(p.x(), p.y()));
  }
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
    for (int row = 0; row < CityPlan::kBlocks; ++row) {
      for (const StreetSide& side : CityPlan::sides(plan.block(column, row))) {
        add_sidewalk_objects(scene, side, random);
      }
    }
  }
  for (const StreetSide& side : plan.outer_pieces()) add_sidewalk_objects(scene, side, random);

  World world;
  world.name = "city";
  world.mesh = scene.mesh.take();
  follow_ground(world.mesh, plan);
  scene.library.move_to(world);
  world.lighting = daylight(seed);
  world.ground_height = [plan](double x, double y) { return plan.ground(x, y); };
  world.routes = city_routes(plan);
  return world;
}

}  // namespace km
