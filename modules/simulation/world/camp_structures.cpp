#include "modules/simulation/world/camp_structures.hpp"

#include <array>
#include <cmath>

#include "modules/simulation/world/openings.hpp"

namespace km {
namespace {

using Eigen::Vector3f;

constexpr SurfaceClass kPole = SurfaceClass::kPole;

MaterialId wood(Scene& scene, SurfaceClass label) {
  return scene.paint(label, Recipe::kWoodPlanks, {0.85F, 0.75F, 0.6F});
}

}  // namespace

void add_watch_tower(Scene& scene) {
  const MaterialId beam = wood(scene, SurfaceClass::kObject);
  const MaterialId roof =
      scene.paint(SurfaceClass::kObject, Recipe::kCorrugatedMetal, {0.5F, 0.5F, 0.48F});
  MeshBuilder& mesh = scene.mesh;
  for (const float x : {-1.2F, 1.2F}) {
    for (const float y : {-1.2F, 1.2F}) {
      mesh.box({x - 0.09F, y - 0.09F, -0.4F}, {x + 0.09F, y + 0.09F, 6.0F}, beam);
    }
    mesh.cylinder({x, -1.2F, 0.3F}, {x, 1.2F, 3.4F}, 0.05F, 0.05F, 6, beam);
    mesh.cylinder({x, 1.2F, 0.3F}, {x, -1.2F, 3.4F}, 0.05F, 0.05F, 6, beam);
    mesh.cylinder({-1.2F, x, 0.3F}, {1.2F, x, 3.4F}, 0.05F, 0.05F, 6, beam);
  }
  mesh.box({-1.5F, -1.5F, 3.6F}, {1.5F, 1.5F, 3.72F}, beam);
  for (const float side : {-1.45F, 1.4F}) {
    for (const float z : {3.9F, 4.2F, 4.5F}) {
      mesh.box({-1.45F, side, z}, {1.45F, side + 0.05F, z + 0.2F}, beam);
      mesh.box({side, -1.45F, z}, {side + 0.05F, 1.45F, z + 0.2F}, beam);
    }
  }
  mesh.quad({-1.8F, -1.8F, 5.9F}, {1.8F, -1.8F, 5.9F}, {1.8F, 1.8F, 6.5F}, {-1.8F, 1.8F, 6.5F},
            roof);
  mesh.quad({1.8F, -1.8F, 5.86F}, {-1.8F, -1.8F, 5.86F}, {-1.8F, 1.8F, 6.46F}, {1.8F, 1.8F, 6.46F},
            roof);
  for (int rung = 0; rung < 12; ++rung) {
    const float z = 0.3F * static_cast<float>(rung) + 0.2F;
    mesh.box({-0.25F, -1.62F, z}, {0.25F, -1.58F, z + 0.04F}, beam);
  }
}

void add_floodlight(Scene& scene) {
  const MaterialId steel = scene.paint(kPole, Recipe::kPaintedMetal, {0.35F, 0.36F, 0.36F});
  const MaterialId lens = scene.plain(kPole, 0.8F, 0.8F, 0.75F, 0.2F);
  MeshBuilder& mesh = scene.mesh;
  mesh.box({-0.3F, -0.3F, -0.3F}, {0.3F, 0.3F, 0.25F}, scene.paint(kPole, Recipe::kConcrete));
  mesh.cylinder({0, 0, 0.2F}, {0, 0, 6.5F}, 0.09F, 0.06F, 10, steel);
  mesh.box({-0.7F, -0.04F, 6.3F}, {0.7F, 0.04F, 6.38F}, steel);
  for (const float x : {-0.5F, 0.5F}) {
    mesh.box({x - 0.25F, -0.2F, 6.4F}, {x + 0.25F, 0.05F, 6.8F}, steel);
    mesh.box({x - 0.21F, -0.215F, 6.44F}, {x + 0.21F, -0.2F, 6.76F}, lens);
  }
}

void add_flag_pole(Scene& scene, SeededRandom& random) {
  const MaterialId white = scene.plain(kPole, 0.7F, 0.7F, 0.7F);
  const std::array<MaterialId, 3> stripes = {
      scene.paint(kPole, Recipe::kCanvas, {0.5F, 0.06F, 0.05F}),
      scene.paint(kPole, Recipe::kCanvas, {0.75F, 0.75F, 0.72F}),
      scene.paint(kPole, Recipe::kCanvas, {0.05F, 0.12F, 0.4F})};
  scene.mesh.cylinder({0, 0, -0.3F}, {0, 0, 8.0F}, 0.06F, 0.04F, 10, white);
  const float wave = random.uniform(0.0F, 6.0F);
  for (int stripe = 0; stripe < 3; ++stripe) {
    const float z0 = 6.6F + 0.4F * static_cast<float>(stripe);
    const auto cloth = [&](bool front) {
      scene.mesh.sheet(
          1, 12,
          [&](int row, int column) {
            const float x = 0.15F * static_cast<float>(front ? column : 12 - column) + 0.05F;
            return Vector3f(x, 0.18F * std::sin(4.0F * x + wave) * x + (front ? 0.0F : 0.006F),
                            z0 + 0.4F * static_cast<float>(row) - 0.1F * x);
          },
          stripes[static_cast<std::size_t>(stripe)]);
    };
    cloth(true);
    cloth(false);
  }
}

void add_notice_board(Scene& scene, SeededRandom& random) {
  const MaterialId post = wood(scene, kPole);
  for (const float x : {-0.9F, 0.8F}) {
    scene.mesh.box({x, 0.0F, -0.3F}, {x + 0.1F, 0.1F, 2.1F}, post);
  }
  add_sign_board(scene, -1.1F, 1.5F, 2.2F, 0.5F, kPole, random);
  add_sign_board(scene, -1.1F, 0.95F, 2.2F, 0.45F, kPole, random);
}

}  // namespace km
