#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include "modules/simulation/world/camp_objects.hpp"
#include "modules/simulation/world/camp_plan.hpp"
#include "modules/simulation/world/camp_site.hpp"
#include "modules/simulation/world/camp_structures.hpp"
#include "modules/simulation/world/camp_surroundings.hpp"
#include "modules/simulation/world/camp_yards.hpp"
#include "modules/simulation/world/people.hpp"
#include "modules/simulation/world/scene.hpp"
#include "modules/simulation/world/tents.hpp"
#include "modules/simulation/world/vegetation.hpp"
#include "modules/simulation/world/vehicles.hpp"
#include "modules/simulation/world/world.hpp"

namespace km {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

constexpr float kPi = std::numbers::pi_v<float>;
void add_one_supply(Scene& scene, SeededRandom& random) {
  switch (random.below(8)) {
    case 0:
    case 1:
      return add_crates(scene, random);
    case 2:
    case 3:
      return add_barrels(scene, random);
    case 4:
      return add_generator(scene, random);
    case 5:
      return add_water_tank(scene, random);
    case 6:
      return add_log_pile(scene, random);
    default:
      return add_sandbags(scene, 3.0F, random);
  }
}

/// Draws places in the camp until `count` objects have found one.
void scatter(CampSite& site, int count, float radius_m, bool tilted, SeededRandom& random,
             const std::function<void()>& add) {
  for (int tries = 0; count > 0 && tries < 6000; ++tries) {
    const float x = random.uniform(-kCampHalfX_m + 3.0F, kCampHalfX_m - 3.0F);
    const float y = random.uniform(-kCampHalfY_m + 3.0F, kCampHalfY_m - 3.0F);
    const float yaw = random.uniform(0.0F, 2.0F * kPi);
    const bool stands =
        tilted ? site.lie({x, y}, yaw, radius_m, add) : site.stand({x, y}, yaw, radius_m, add);
    if (stands) --count;
  }
}

/// One thing beside a track. `out` points away from the track's `middle`, `yaw` faces it.
void add_beside_track(Scene& scene, CampSite& site, const Vector2f& middle, const Vector2f& out,
                      SeededRandom& random) {
  const float yaw = std::atan2(out.y(), out.x()) - 0.5F * kPi;
  const auto at = [&](float distance) { return Vector2f(middle + distance * out); };
  const float any_yaw = random.uniform(0.0F, 2.0F * kPi);
  switch (random.below(14)) {
    case 0:
    case 1:
      site.lie(at(6.2F), yaw, 1.6F, [&] { add_one_supply(scene, random); });
      return;
    case 2:
      site.lie(at(6.0F), yaw, 1.6F, [&] { add_barrier(scene); });
      return;
    case 3:
      site.stand(at(5.2F), any_yaw, 0.6F, [&] { add_person(scene, random); });
      return;
    case 4:
      site.stand(at(5.6F), yaw, 1.2F, [&] { add_notice_board(scene, random); });
      return;
    case 5:
      site.lie(at(6.8F), yaw + 0.5F * kPi, 2.3F, [&] { add_army_jeep(scene, random); });
      return;
    case 6:
      site.lie(at(8.0F), yaw + 0.5F * kPi, 3.4F, [&] { add_army_truck(scene, random); });
      return;
    case 7:
    case 8:
      site.lie(at(7.7F), yaw, 3.3F, [&] { add_container(scene, random); });
      return;
    case 9:
      site.stand(at(9.0F), yaw, 4.4F, [&] {
        const ScopedFrame front(scene.mesh, standing_at({0.0F, -3.0F, 0.0F}, 0.0F));
        add_house_tent(scene, 6.0F, random.chance(0.5) ? kSand : kOlive, random);
      });
      return;
    case 10:
      site.stand(at(5.0F), yaw, 0.5F, [&] { add_floodlight(scene); });
      return;
    case 11:
      site.stand(at(6.4F), any_yaw, 1.2F,
                 [&] { add_tree(scene, {.height_m = random.uniform(5.0F, 8.0F)}, random); });
      return;
    case 12:
      site.stand(at(5.8F), any_yaw, 1.0F,
                 [&] { add_bush(scene, random.uniform(0.6F, 1.0F), random); });
      return;
    default:
      site.lie(at(5.4F), any_yaw, 0.8F,
               [&] { add_rock(scene, random.uniform(0.6F, 1.5F), random); });
  }
}

/// Both edges of every track, where the robots pass.
void add_along_tracks(Scene& scene, CampSite& site, const CampPlan& plan, SeededRandom& random) {
  constexpr int kTries = 4;
  for (const Track& track : plan.tracks()) {
    for (std::size_t i = 0; i + 1 < track.size(); ++i) {
      const Vector2f piece = track[i + 1] - track[i];
      const Vector2f right = Vector2f(piece.y(), -piece.x()).normalized();
      for (int k = 0; k < kTries; ++k) {
        const float share = random.uniform(0.0F, 1.0F);
        const float side = random.sign();
        add_beside_track(scene, site, track[i] + share * piece, side * right, random);
      }
    }
  }
}

}  // namespace

World make_camp(std::uint64_t seed) {
  const CampPlan plan(seed);
  Scene scene(seed);
  SeededRandom random = SeededRandom::stream(seed, 61);
  add_camp_ground(scene, plan, seed);
  CampSite site(scene, plan);
  add_yards(scene, site, plan, seed);
  add_perimeter(scene, plan, site);
  add_along_tracks(scene, site, plan, random);
  scatter(site, 60, 1.8F, true, random, [&] { add_one_supply(scene, random); });
  scatter(site, 8, 1.0F, false, random, [&] { add_toilet_cabin(scene, random); });
  scatter(site, 40, 0.7F, false, random, [&] { add_person(scene, random); });
  scatter(site, 70, 0.9F, true, random,
          [&] { add_rock(scene, random.uniform(0.4F, 1.4F), random); });
  scatter(site, 45, 1.3F, false, random,
          [&] { add_tree(scene, {.height_m = random.uniform(5.0F, 8.5F)}, random); });
  scatter(site, 40, 1.2F, false, random,
          [&] { add_bush(scene, random.uniform(0.5F, 1.0F), random); });
  add_camp_wood(scene, plan, random);
  add_camp_grass(scene, plan, random);

  World world;
  world.name = "camp";
  world.mesh = scene.mesh.take();
  scene.library.move_to(world);
  world.lighting.to_sun = Vector3f(0.5F, -0.45F, 0.75F).normalized();
  world.lighting.sun = 0.8F;
  world.lighting.ambient = 0.32F;
  world.lighting.haze_distance_m = 700.0F;
  world.routes = plan.routes();
  world.ground_height = [plan](double x, double y) { return plan.ground(x, y); };
  return world;
}

}  // namespace km
