#include "modules/simulation/world/camp_yards.hpp"

#include <cmath>
#include <numbers>

#include "modules/simulation/world/camp_objects.hpp"
#include "modules/simulation/world/camp_structures.hpp"
#include "modules/simulation/world/tents.hpp"
#include "modules/simulation/world/vehicles.hpp"

namespace km {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

constexpr float kPi = std::numbers::pi_v<float>;

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

}  // namespace

void add_yards(Scene& scene, CampSite& site, const CampPlan& plan, std::uint64_t seed) {
  SeededRandom random = SeededRandom::stream(seed, 62);
  add_tent_rows(scene, site, plan.yard_center(0, 1), seed);
  add_container_yard(scene, site, plan.yard_center(1, 1), random);
  add_motor_pool(scene, site, plan.yard_center(2, 1), random);
  add_headquarters(scene, site, plan.yard_center(0, 0), random);
  add_domes(scene, site, plan.yard_center(1, 0), random);
  add_tent_rows(scene, site, plan.yard_center(2, 0), seed);  // like the first
}

}  // namespace km
