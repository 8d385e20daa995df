#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include "modules/simulation/world/camp_objects.hpp"
#include "modules/simulation/world/camp_plan.hpp"
#include "modules/simulation/world/camp_site.hpp"
#include "modules/simulation/world/people.hpp"
#include "modules/simulation/world/scene.hpp"
#include "modules/simulation/world/street_furniture.hpp"
#include "modules/simulation/world/tents.hpp"
#include "modules/simulation/world/vegetation.hpp"
#include "modules/simulation/world/vehicles.hpp"
#include "modules/simulation/world/world.hpp"

namespace km {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

constexpr float kPi = std::numbers::pi_v<float>;
const Vector3f kOlive(0.2F, 0.22F, 0.12F);
const Vector3f kSand(0.55F, 0.46F, 0.32F);
const Vector3f kWhite(0.72F, 0.71F, 0.68F);

void add_ground(Scene& scene, const CampPlan& plan, std::uint64_t seed) {
  const MaterialId grass = scene.paint(SurfaceClass::kTerrain, Recipe::kGrass);
  const MaterialId bare = scene.paint(SurfaceClass::kTerrain, Recipe::kSoil, {1.05F, 1.0F, 0.85F});
  const MaterialId track = scene.paint(SurfaceClass::kRoad, Recipe::kSoil);
  const Heightfield& near = plan.near_ground();
  const auto paint_at = [&](int row, int column) {  // borders fray
    const Vector2f p = near.point(row, column).head<2>() + Vector2f(0.25F, 0.25F);
    const float fray = 0.7F * ground_noise(p.x(), p.y(), 2.3F, seed + 7) +
                       0.5F * ground_noise(p.x(), p.y(), 0.7F, seed + 8);
    const float distance = plan.distance_to_track(p) + fray;
    const float trodden = ground_noise(p.x(), p.y(), 11.0F, seed + 9) + 0.5F * fray;
    if (distance < kTrackHalf_m) return track;
    return trodden > 0.15F || distance < 4.6F ? bare : grass;
  };
  scene.mesh.sheet(
      near.rows(), near.columns(), [&](int row, int column) { return near.point(row, column); },
      paint_at, true);
  const Heightfield& far = plan.far_ground();
  scene.mesh.sheet(
      far.rows(), far.columns(), [&](int row, int column) { return far.point(row, column); },
      [&](int row, int column) -> std::optional<MaterialId> {
        const Vector3f middle = 0.5F * (far.point(row, column) + far.point(row + 1, column + 1));
        if (near.contains(middle.x(), middle.y())) return std::nullopt;
        return grass;
      },
      true);
}

/// Equal tents in rank and file.
void add_tent_rows(Scene& scene, CampSite& site, const Vector2f& center, std::uint64_t seed) {
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 5; ++column) {
      SeededRandom same = SeededRandom::stream(seed, 60);  // every tent alike
      const Vector2f p = center + Vector2f(6.6F * (static_cast<float>(column) - 2.0F),
                                           9.0F * (static_cast<float>(row) - 1.0F));
      site.stand(p + Vector2f(0.0F, -2.0F), 0.0F, 2.9F,
                 [&] { add_ridge_tent(scene, kOlive, same); });
    }
  }
}

void add_headquarters(Scene& scene, CampSite& site, const Vector2f& center, SeededRandom& random) {
  site.stand(center + Vector2f(-9.0F, 2.0F), 0.0F, 6.5F,
             [&] { add_tunnel_shelter(scene, 10.8F, kSand); });
  site.stand(center + Vector2f(5.0F, -6.0F), 0.5F * kPi, 5.6F,
             [&] { add_house_tent(scene, 8.0F, kSand, random); });
  site.stand(center + Vector2f(5.0F, 7.0F), 0.5F * kPi, 5.6F,
             [&] { add_house_tent(scene, 8.0F, kWhite, random); });
  site.stand(center + Vector2f(-1.0F, -9.0F), 0.0F, 0.6F, [&] { add_flag_pole(scene, random); });
  site.stand(center + Vector2f(-4.0F, -10.0F), 0.0F, 1.3F,
             [&] { add_notice_board(scene, random); });
}

void add_domes(Scene& scene, CampSite& site, const Vector2f& center, SeededRandom& random) {
  for (int i = 0; i < 5; ++i) {
    const float angle = 2.0F * kPi * static_cast<float>(i) / 5.0F;
    const Vector2f p = center + Vector2f(11.0F * std::cos(angle), 9.5F * std::sin(angle));
    const bool big = i == 2;
    site.stand(p, angle - 0.5F * kPi, big ? 4.4F : 3.8F,
               [&] { add_dome_tent(scene, big ? 3.2F : 2.6F, i % 2 == 0 ? kSand : kWhite); });
  }
  site.stand(center, random.uniform(0.0F, 1.0F), 3.4F, [&] { add_awning_roof(scene, kOlive); });
}

void add_container_yard(Scene& scene, CampSite& site, const Vector2f& center,
                        SeededRandom& random) {
  for (int row = -1; row <= 1; ++row) {
    for (int column = -1; column <= 1; ++column) {
      const Vector2f p =
          center + Vector2f(8.5F * static_cast<float>(column), 8.0F * static_cast<float>(row));
      const bool along = random.chance(0.6);
      const bool two = random.chance(0.35);
      site.lie(p, along ? 0.0F : 0.5F * kPi, 3.4F, [&] {
        add_container(scene, random);
        if (two) {
          const ScopedFrame upper(scene.mesh,
                                  standing_at({random.uniform(-0.1F, 0.1F), 0.0F, 2.6F}, 0.0F));
          add_container(scene, random);
        }
      });
    }
  }
}

void add_motor_pool(Scene& scene, CampSite& site, const Vector2f& center, SeededRandom& random) {
  for (int i = 0; i < 6; ++i) {
    const float x = 5.2F * (static_cast<float>(i) - 2.5F);
    site.lie(center + Vector2f(x, -7.0F), 0.5F * kPi + random.uniform(-0.06F, 0.06F), 2.6F, [&] {
      const ScopedFrame back(scene.mesh, standing_at({-1.0F, 0.0F, 0.0F}, 0.0F));
      add_army_truck(scene, random);
    });
    site.lie(center + Vector2f(x, 6.0F), -0.5F * kPi + random.uniform(-0.08F, 0.08F), 2.4F,
             [&] { add_army_jeep(scene, random); });
  }
}

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

/// Objects along both edges of every track, where the robots pass.
void add_along_tracks(Scene& scene, CampSite& site, const CampPlan& plan, SeededRandom& random) {
  for (const Track& track : plan.tracks()) {
    for (std::size_t i = 0; i + 1 < track.size(); ++i) {
      const Vector2f along = (track[i + 1] - track[i]).normalized();
      for (const float side : {-1.0F, 1.0F}) {
        const Vector2f out = side * Vector2f(along.y(), -along.x());
        const float share = random.uniform(0.2F, 0.8F);
        const Vector2f middle = track[i] + share * (track[i + 1] - track[i]);
        const float yaw = std::atan2(out.y(), out.x()) + 0.5F * kPi;  // faces the track
        const int kind = random.below(9);
        const auto at = [&](float distance) { return Vector2f(middle + distance * out); };
        if (kind <= 1) {
          site.lie(at(7.0F), yaw, 1.6F, [&] { add_one_supply(scene, random); });
        } else if (kind == 2) {
          site.lie(at(6.6F), yaw, 1.7F, [&] { add_barrier(scene); });
        } else if (kind == 3) {
          site.stand(at(6.0F), yaw, 0.7F, [&] { add_person(scene, random); });
        } else if (kind == 4) {
          site.stand(at(6.2F), yaw, 1.2F, [&] { add_notice_board(scene, random); });
        } else if (kind == 5) {
          site.lie(at(7.4F), yaw + 0.5F * kPi, 2.4F, [&] { add_army_jeep(scene, random); });
        } else if (kind == 6) {
          site.stand(at(5.8F), yaw, 0.5F, [&] { add_floodlight(scene); });
        } else if (kind == 7) {
          site.stand(at(7.2F), random.uniform(0.0F, 6.0F), 1.2F, [&] {
            add_tree(scene, {.height_m = random.uniform(5.0F, 8.0F), .leaves = 1500}, random);
          });
        } else {
          site.lie(at(6.2F), random.uniform(0.0F, 6.0F), 0.8F,
                   [&] { add_rock(scene, random.uniform(0.6F, 1.5F), random); });
        }
      }
    }
  }
}

void add_perimeter(Scene& scene, const CampPlan& plan, CampSite& site) {
  const std::array<Vector2f, 4> corners = {{{-kCampHalfX_m, -kCampHalfY_m},
                                            {kCampHalfX_m, -kCampHalfY_m},
                                            {kCampHalfX_m, kCampHalfY_m},
                                            {-kCampHalfX_m, kCampHalfY_m}}};
  constexpr float kPiece_m = 5.0F;
  for (std::size_t i = 0; i < 4; ++i) {
    const Vector2f a = corners[i];
    const Vector2f b = corners[(i + 1) % 4];
    const Vector2f along = (b - a).normalized();
    const int pieces = static_cast<int>((b - a).norm() / kPiece_m);
    for (int k = 0; k < pieces; ++k) {
      const Vector2f p = a + kPiece_m * static_cast<float>(k) * along;
      const Vector2f q = p + kPiece_m * along;
      const Vector3f from(p.x(), p.y(), static_cast<float>(plan.ground(p.x(), p.y())));
      const Vector3f to(q.x(), q.y(), static_cast<float>(plan.ground(q.x(), q.y())));
      const float pitch = std::atan2(to.z() - from.z(), kPiece_m);
      Eigen::Isometry3f T = standing_at(from, std::atan2(along.y(), along.x()));
      T.rotate(Eigen::AngleAxisf(-pitch, Vector3f::UnitY()));
      const ScopedFrame frame(scene.mesh, T);
      add_wire_fence(scene, kPiece_m, 2.3F);
    }
    const Vector2f inside = 0.955F * a;
    site.stand(inside, static_cast<float>(i) * 0.5F * kPi, 2.2F, [&] { add_watch_tower(scene); });
  }
}

void add_wood(Scene& scene, const CampPlan& plan, SeededRandom& random) {
  for (int i = 0; i < 260; ++i) {
    const float x = random.uniform(-150.0F, 150.0F);
    const float y = random.uniform(-126.0F, 126.0F);
    if (std::abs(x) < kCampHalfX_m + 4.0F && std::abs(y) < kCampHalfY_m + 4.0F) continue;
    const auto z = static_cast<float>(plan.ground(x, y));
    const ScopedFrame frame(scene.mesh, standing_at({x, y, z}, random.uniform(0.0F, 6.0F)));
    if (random.chance(0.7)) {
      add_conifer(scene, random.uniform(5.0F, 11.0F), random);
    } else {
      add_tree(scene, {.height_m = random.uniform(6.0F, 10.0F), .leaves = 900, .leaf_m = 0.4F},
               random);
    }
  }
}

void add_grass(Scene& scene, const CampPlan& plan, SeededRandom& random) {
  for (int i = 0; i < 9000; ++i) {
    const Vector2f p(random.uniform(-kCampHalfX_m, kCampHalfX_m),
                     random.uniform(-kCampHalfY_m, kCampHalfY_m));
    const float track = plan.distance_to_track(p);
    if (track < kTrackHalf_m - 0.2F || track > 14.0F) continue;
    const ScopedFrame frame(
        scene.mesh,
        standing_at({p.x(), p.y(), static_cast<float>(plan.ground(p.x(), p.y()))}, 0.0F));
    add_tuft(scene, random.uniform(0.12F, 0.3F), random);
  }
}

void add_yards(Scene& scene, CampSite& site, const CampPlan& plan, std::uint64_t seed,
               SeededRandom& random) {
  add_tent_rows(scene, site, plan.yard_center(0, 1), seed);
  add_container_yard(scene, site, plan.yard_center(1, 1), random);
  add_motor_pool(scene, site, plan.yard_center(2, 1), random);
  add_headquarters(scene, site, plan.yard_center(0, 0), random);
  add_domes(scene, site, plan.yard_center(1, 0), random);
  add_tent_rows(scene, site, plan.yard_center(2, 0), seed);  // like the first
}

}  // namespace

World make_camp(std::uint64_t seed) {
  const CampPlan plan(seed);
  Scene scene(seed);
  SeededRandom random = SeededRandom::stream(seed, 61);
  add_ground(scene, plan, seed);
  CampSite site(scene, plan);
  add_yards(scene, site, plan, seed, random);
  add_perimeter(scene, plan, site);
  add_along_tracks(scene, site, plan, random);
  scatter(site, 45, 1.8F, true, random, [&] { add_one_supply(scene, random); });
  scatter(site, 8, 1.0F, false, random, [&] { add_toilet_cabin(scene, random); });
  scatter(site, 40, 0.7F, false, random, [&] { add_person(scene, random); });
  scatter(site, 70, 0.9F, true, random,
          [&] { add_rock(scene, random.uniform(0.4F, 1.4F), random); });
  scatter(site, 40, 1.3F, false, random, [&] {
    add_tree(scene, {.height_m = random.uniform(5.0F, 8.5F), .leaves = 1500}, random);
  });
  scatter(site, 40, 1.2F, false, random,
          [&] { add_bush(scene, random.uniform(0.5F, 1.0F), random); });
  add_wood(scene, plan, random);
  add_grass(scene, plan, random);

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
