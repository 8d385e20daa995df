#include "modules/simulation/world/park.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "modules/simulation/world/people.hpp"
#include "modules/simulation/world/street_furniture.hpp"
#include "modules/simulation/world/vegetation.hpp"

namespace km {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

constexpr float kPi = std::numbers::pi_v<float>;
constexpr float kGate_m = 4.0F;
constexpr float kPath_m = 2.6F;

/// Railing or hedge along a side, open in the middle.
void add_boundary(Scene& scene, const StreetSide& side, bool hedge, SeededRandom& random) {
  const float half = 0.5F * (side.length_m - kGate_m);
  for (const float x : {0.3F, half + kGate_m}) {
    const ScopedFrame frame(scene.mesh, side.T_world_side * standing_at({x, 0.3F, 0.0F}, 0.0F));
    if (hedge) {
      add_hedge(scene, half - 0.3F, 0.8F, 1.1F, random);
    } else {
      add_railing(scene, half - 0.3F, 1.2F);
    }
  }
  const MaterialId stone = scene.paint(SurfaceClass::kFence, Recipe::kStoneBlocks);
  const ScopedFrame frame(scene.mesh, side.T_world_side);
  for (const float x : {half - 0.2F, half + kGate_m - 0.4F}) {
    scene.mesh.box({x, 0.0F, -0.2F}, {x + 0.6F, 0.6F, 1.7F}, stone, kSidesNoBottom);
    scene.mesh.box({x - 0.08F, -0.08F, 1.7F}, {x + 0.68F, 0.68F, 1.82F}, stone);
    scene.mesh.ellipsoid({x + 0.3F, 0.3F, 2.0F}, {0.22F, 0.22F, 0.22F}, 14, stone);
  }
}

/// A path in cells along x from 0 to `length`.
void add_path(Scene& scene, float length, MaterialId gravel) {
  const int cells = static_cast<int>(length / 2.0F);
  scene.mesh.sheet(
      1, cells,
      [&](int row, int column) {
        return Vector3f(length * static_cast<float>(column) / static_cast<float>(cells),
                        (row == 0 ? -0.5F : 0.5F) * kPath_m, 0.012F);
      },
      gravel);
}

/// A basin with a pillar and a figure.
void add_monument(Scene& scene, SeededRandom& random) {
  const MaterialId stone =
      scene.paint(SurfaceClass::kObject, Recipe::kConcrete, {0.95F, 0.92F, 0.85F});
  const MaterialId water = scene.plain(SurfaceClass::kObject, 0.03F, 0.06F, 0.06F, 0.5F);
  MeshBuilder& mesh = scene.mesh;
  const std::array<Vector2f, 5> rim = {
      {{2.6F, -0.1F}, {2.5F, 0.5F}, {2.6F, 0.55F}, {2.6F, 0.65F}, {2.3F, 0.65F}}};
  mesh.revolve(rim, 32, stone);
  mesh.cylinder({0, 0, 0}, {0, 0, 0.52F}, 2.35F, 2.35F, 32, water);
  const std::array<Vector2f, 8> pillar = {{{0.8F, 0.5F},
                                           {0.7F, 0.9F},
                                           {0.4F, 1.0F},
                                           {0.3F, 1.6F},
                                           {0.35F, 2.3F},
                                           {0.6F, 2.5F},
                                           {0.6F, 2.65F},
                                           {0.0F, 2.7F}}};
  mesh.revolve(pillar, 20, stone);
  const ScopedFrame figure(mesh, standing_at({0, 0, 2.68F}, random.uniform(0.0F, 2.0F * kPi)));
  add_person(scene, random);
}

}  // namespace

void add_park(Scene& scene, const Eigen::AlignedBox2f& kerb, SeededRandom& random) {
  const auto sides = CityPlan::sides(kerb);
  for (std::size_t i = 0; i < sides.size(); ++i) {
    add_boundary(scene, sides[i], i % 2 == 0, random);
  }
  const Vector2f centre = kerb.center();
  const ScopedFrame middle(scene.mesh, standing_at({centre.x(), centre.y(), kKerb_m}, 0.0F));
  const float half_x = 0.5F * kerb.sizes().x() - kSidewalk_m;
  const float half_y = 0.5F * kerb.sizes().y() - kSidewalk_m;
  const MaterialId gravel = scene.paint(SurfaceClass::kTerrain, Recipe::kGravel);
  for (int arm = 0; arm < 4; ++arm) {
    const ScopedFrame path(scene.mesh,
                           standing_at(Vector3f::Zero(), 0.5F * kPi * static_cast<float>(arm)));
    add_path(scene, arm % 2 == 0 ? half_x : half_y, gravel);
    for (const float x : {5.5F, 9.0F}) {
      const ScopedFrame at(scene.mesh, standing_at({x, 0.5F * kPath_m + 0.5F, 0.0F}, 0.0F));
      add_bench(scene);
    }
    const ScopedFrame lamp(scene.mesh, standing_at({7.2F, -0.5F * kPath_m - 0.5F, 0.0F}, kPi));
    add_street_lamp(scene, random);
  }
  add_monument(scene, random);
  // Trees on a jittered grid, off the paths and the monument.
  for (float x = -half_x + 4.0F; x < half_x - 3.0F; x += 6.5F) {
    for (float y = -half_y + 3.5F; y < half_y - 2.5F; y += 6.0F) {
      const float px = x + random.uniform(-1.2F, 1.2F);
      const float py = y + random.uniform(-1.0F, 1.0F);
      const bool on_path = std::min(std::abs(px), std::abs(py)) < 2.2F;
      if (on_path || std::hypot(px, py) < 5.0F) continue;
      const ScopedFrame at(scene.mesh, standing_at({px, py, 0.0F}, random.uniform(0.0F, 6.0F)));
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
    const ScopedFrame at(scene.mesh, standing_at({along, random.uniform(-0.9F, 0.9F), 0.0F},
                                                 random.uniform(0.0F, 6.0F)));
    add_person(scene, random);
  }
}

}  // namespace km
