#include <algorithm>
#include <array>
#include <cmath>

#include "apps/lab/simulation/world/objects.hpp"
#include "apps/lab/simulation/world/terrain.hpp"

namespace km {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;
using enum Recipe;

constexpr SurfaceClass kObjectLabel = SurfaceClass::kObject;
constexpr SurfaceClass kPole = SurfaceClass::kPole;

MaterialId wood(Scene& scene, SurfaceClass label = kObjectLabel) {
  return scene.paint(label, kWoodPlanks, {0.85F, 0.75F, 0.6F});
}

void add_container_doors(Scene& scene, float x, const Vector3f& half, MaterialId skin,
                         MaterialId steel) {
  for (const float side : {-1.0F, 1.0F}) {
    const float y0 = std::min(side * 0.03F, side * (half.y() - 0.12F));
    const float y1 = std::max(side * 0.03F, side * (half.y() - 0.12F));
    scene.box({x - 0.04F, y0, 0.16F}, {x + 0.02F, y1, 2.0F * half.z() - 0.14F}, skin);
    for (const float bar : {0.28F, 0.85F}) {
      const float y = side * bar * half.y();
      scene.cylinder({x + 0.05F, y, 0.12F}, {x + 0.05F, y, 2.0F * half.z() - 0.1F}, 0.022F, 0.022F,
                     6, steel, false);
      scene.box({x + 0.02F, y - 0.14F, 1.05F}, {x + 0.09F, y + 0.14F, 1.1F}, steel);
    }
  }
}

/// Corrugations of a long wall as geometry: trapezoids along x at y, facing side.
void add_corrugated_wall(Scene& scene, float half_x, float y, float side, float z0, float z1,
                         MaterialId skin) {
  constexpr float kPitch = 0.28F;
  constexpr float kDepth = 0.036F;
  const int waves = static_cast<int>(2.0F * half_x / kPitch);
  const float pitch = 2.0F * half_x / static_cast<float>(waves);
  const auto wall = [&](float xa, float ya, float xb, float yb) {
    if (side < 0.0F)
      scene.quad({xa, ya, z0}, {xb, yb, z0}, {xb, yb, z1}, {xa, ya, z1}, skin);
    else
      scene.quad({xb, yb, z0}, {xa, ya, z0}, {xa, ya, z1}, {xb, yb, z1}, skin);
  };
  const float inner = y - side * kDepth;
  for (int i = 0; i < waves; ++i) {
    const float x = -half_x + pitch * static_cast<float>(i);
    wall(x, y, x + 0.25F * pitch, y);
    wall(x + 0.25F * pitch, y, x + 0.5F * pitch, inner);
    wall(x + 0.5F * pitch, inner, x + 0.75F * pitch, inner);
    wall(x + 0.75F * pitch, inner, x + pitch, y);
  }
}

}  // namespace

void add_watch_tower(Scene& scene) {
  const Scene::Object object(scene);
  const auto beam = wood(scene);
  const auto roof = scene.paint(kObjectLabel, kCorrugatedMetal, {0.5F, 0.5F, 0.48F});
  for (const float x : {-1.2F, 1.2F}) {
    for (const float y : {-1.2F, 1.2F})
      scene.box({x - 0.09F, y - 0.09F, -0.4F}, {x + 0.09F, y + 0.09F, 6.0F}, beam);
    scene.cylinder({x, -1.2F, 0.3F}, {x, 1.2F, 3.4F}, 0.05F, 0.05F, 6, beam);
    scene.cylinder({x, 1.2F, 0.3F}, {x, -1.2F, 3.4F}, 0.05F, 0.05F, 6, beam);
    scene.cylinder({-1.2F, x, 0.3F}, {1.2F, x, 3.4F}, 0.05F, 0.05F, 6, beam);
  }
  scene.box({-1.5F, -1.5F, 3.6F}, {1.5F, 1.5F, 3.72F}, beam);
  for (const float side : {-1.45F, 1.4F}) {
    for (const float z : {3.9F, 4.2F, 4.5F}) {
      scene.box({-1.45F, side, z}, {1.45F, side + 0.05F, z + 0.2F}, beam);
      scene.box({side, -1.45F, z}, {side + 0.05F, 1.45F, z + 0.2F}, beam);
    }
  }
  scene.quad({-1.8F, -1.8F, 5.9F}, {1.8F, -1.8F, 5.9F}, {1.8F, 1.8F, 6.5F}, {-1.8F, 1.8F, 6.5F},
             roof);
  scene.quad({1.8F, -1.8F, 5.86F}, {-1.8F, -1.8F, 5.86F}, {-1.8F, 1.8F, 6.46F}, {1.8F, 1.8F, 6.46F},
             roof);
  for (float rung = 0; rung < 12; ++rung) {
    const float z = 0.3F * rung + 0.2F;
    scene.box({-0.25F, -1.62F, z}, {0.25F, -1.58F, z + 0.04F}, beam);
  }
}

void add_floodlight(Scene& scene) {
  const Scene::Object object(scene);
  const auto steel = scene.paint(kPole, kPaintedMetal, {0.35F, 0.36F, 0.36F});
  const auto lens = scene.plain(kPole, {0.8F, 0.8F, 0.75F}, 0.2F);
  scene.box({-0.3F, -0.3F, -0.3F}, {0.3F, 0.3F, 0.25F}, scene.paint(kPole, kConcrete));
  scene.cylinder({0, 0, 0.2F}, {0, 0, 6.5F}, 0.09F, 0.06F, 10, steel);
  scene.box({-0.7F, -0.04F, 6.3F}, {0.7F, 0.04F, 6.38F}, steel);
  for (const float x : {-0.5F, 0.5F}) {
    scene.box({x - 0.25F, -0.2F, 6.4F}, {x + 0.25F, 0.05F, 6.8F}, steel);
    scene.box({x - 0.21F, -0.215F, 6.44F}, {x + 0.21F, -0.2F, 6.76F}, lens);
  }
}

void add_flag_pole(Scene& scene, SeededRandom& random) {
  const Scene::Object object(scene);
  const auto white = scene.plain(kPole, {0.7F, 0.7F, 0.7F});
  const std::array<MaterialId, 3> stripes = {scene.paint(kPole, kCanvas, {0.5F, 0.06F, 0.05F}),
                                             scene.paint(kPole, kCanvas, {0.75F, 0.75F, 0.72F}),
                                             scene.paint(kPole, kCanvas, {0.05F, 0.12F, 0.4F})};
  scene.cylinder({0, 0, -0.3F}, {0, 0, 8.0F}, 0.06F, 0.04F, 10, white);
  const float wave = random.uniform(0.0F, 6.0F);
  for (int stripe = 0; stripe < 3; ++stripe) {
    const float z0 = 6.6F + 0.4F * static_cast<float>(stripe);
    const auto cloth = [&](bool front) {
      const auto point = [&](float row, int column) {
        const float x = 0.15F * static_cast<float>(front ? column : 12 - column) + 0.05F;
        return Vector3f(x, 0.18F * std::sin(4.0F * x + wave) * x + (front ? 0.0F : 0.006F),
                        z0 + 0.4F * row - 0.1F * x);
      };
      scene.sheet(1, 12, point, stripes[static_cast<std::size_t>(stripe)]);
    };
    cloth(true);
    cloth(false);
  }
}

void add_notice_board(Scene& scene, SeededRandom& random) {
  const Scene::Object object(scene);
  const auto post = wood(scene, kPole);
  for (const float x : {-0.9F, 0.8F}) scene.box({x, 0.0F, -0.3F}, {x + 0.1F, 0.1F, 2.1F}, post);
  add_sign_board(scene, -1.1F, 1.5F, 2.2F, 0.5F, kPole, random);
  add_sign_board(scene, -1.1F, 0.95F, 2.2F, 0.45F, kPole, random);
}

void add_container(Scene& scene, SeededRandom& random) {
  const Scene::Object object(scene);
  const Vector3f tints[] = {{0.2F, 0.22F, 0.12F},  {0.42F, 0.1F, 0.06F}, {0.06F, 0.15F, 0.3F},
                            {0.55F, 0.53F, 0.48F}, {0.5F, 0.42F, 0.26F}, {0.1F, 0.24F, 0.16F}};
  const Vector3f tint = random.pick(tints);
  const bool bland = random.chance(0.25);
  const auto skin = scene.paint(kObjectLabel, bland ? kPlain : kPaintedMetal, tint);
  const auto steel = scene.paint(kObjectLabel, kPaintedMetal, 0.7F * tint);
  const Vector3f half(3.03F, 1.22F, 1.295F);
  const float top = 2.0F * half.z();
  for (const float side : {-1.0F, 1.0F}) {
    if (bland) {
      const float y = side * (half.y() - 0.02F);
      scene.box({-half.x() + 0.05F, std::min(y, 0.9F * y), 0.12F},
                {half.x() - 0.05F, std::max(y, 0.9F * y), top - 0.08F}, skin);
    } else {
      add_corrugated_wall(scene, half.x() - 0.08F, side * (half.y() - 0.015F), side, 0.12F,
                          top - 0.08F, skin);
    }
    const float y0 = side > 0.0F ? half.y() - 0.1F : -half.y();
    scene.box({-half.x(), y0, -0.25F}, {half.x(), y0 + 0.1F, 0.14F}, steel);
    scene.box({-half.x(), y0, top - 0.1F}, {half.x(), y0 + 0.1F, top}, steel);
    for (const float x : {-half.x(), half.x() - 0.12F})
      scene.box({x, y0, 0.0F}, {x + 0.12F, y0 + 0.1F, top + 0.01F}, steel);
  }
  scene.box({-half.x() + 0.02F, -half.y() + 0.05F, top - 0.06F},
            {half.x() - 0.02F, half.y() - 0.05F, top - 0.02F}, skin);
  scene.box({-half.x() + 0.01F, -half.y() + 0.05F, 0.05F},
            {-half.x() + 0.06F, half.y() - 0.05F, top}, skin);
  add_container_doors(scene, half.x() - 0.03F, half, skin, steel);
  if (random.chance(0.5)) {  // the owner's mark
    scene.at({-1.2F, -half.y() - 0.0F, 0.0F})
        .add(add_sign_board, 0.0F, 1.55F, 2.0F, 0.42F, kObjectLabel, random);
  }
}

void add_crates(Scene& scene, SeededRandom& random) {
  const Scene::Object object(scene);
  const auto boards = random.chance(0.5)
                          ? wood(scene)
                          : scene.paint(kObjectLabel, kWoodPlanks, {0.38F, 0.42F, 0.26F});
  const auto batten = wood(scene);
  const int count = 2 + random.below(4);
  for (int i = 0; i < count; ++i) {
    const bool upper = i >= 3;
    const Vector3f at(static_cast<float>(i % 3) * 1.05F - 1.05F, random.uniform(-0.15F, 0.15F),
                      upper ? 0.82F : -0.05F);
    const auto frame = scene.at(at, random.uniform(-0.15F, 0.15F));
    const float w = 0.48F;
    const float h = upper ? 0.6F : 0.87F;
    scene.box({-w, -0.38F, 0.0F}, {w, 0.38F, h}, boards);
    for (const float x : {-w - 0.02F, w - 0.06F})
      for (const float y : {-0.4F, 0.36F})
        scene.box({x, y, 0.0F}, {x + 0.08F, y + 0.04F, h + 0.01F}, batten);
    for (const float z : {0.04F, h - 0.1F}) {
      scene.box({-w, -0.4F, z}, {w, -0.38F, z + 0.08F}, batten);
      scene.box({-w, 0.38F, z}, {w, 0.4F, z + 0.08F}, batten);
    }
  }
}

void add_barrels(Scene& scene, SeededRandom& random) {
  const Scene::Object object(scene);
  const Vector3f tints[] = {
      {0.06F, 0.16F, 0.36F}, {0.22F, 0.24F, 0.13F}, {0.45F, 0.1F, 0.05F}, {0.3F, 0.3F, 0.3F}};
  const int count = 2 + random.below(5);
  for (int i = 0; i < count; ++i) {
    const auto skin = scene.paint(kObjectLabel, kPaintedMetal, random.pick(tints));
    const auto frame = scene.at({0.66F * static_cast<float>(i % 3) + random.uniform(-0.03F, 0.03F),
                                 0.64F * static_cast<float>(i / 3), 0.0F},
                                random.uniform(0.0F, 6.0F));
    const float r = 0.29F;
    const Vector2f profile[] = {{r, -0.1F}, {r, 0.28F}, {r + 0.015F, 0.3F},
                                {r, 0.32F}, {r, 0.57F}, {r + 0.015F, 0.59F},
                                {r, 0.61F}, {r, 0.88F}, {r - 0.02F, 0.89F}};
    scene.revolve(profile, 16, skin);
    scene.cylinder({0, 0, 0.8F}, {0, 0, 0.87F}, r - 0.01F, r - 0.01F, 16, skin);
  }
}

void add_sandbags(Scene& scene, float length_m, SeededRandom& random) {
  const Scene::Object object(scene);
  const auto cloth = scene.paint(kObjectLabel, kCanvas, {0.5F, 0.42F, 0.28F}, 0.3F);
  const int bags = std::max(1, static_cast<int>(length_m / 0.5F));
  for (int layer = 0; layer < 5; ++layer) {
    for (int bag = 0; bag < bags; ++bag) {
      const float x = 0.5F * (static_cast<float>(bag) + (layer % 2 == 0 ? 0.25F : 0.5F));
      const Vector3f at(x, random.uniform(-0.03F, 0.03F),
                        0.04F + 0.16F * static_cast<float>(layer));
      const auto frame = scene.at(at, random.uniform(-0.12F, 0.12F));
      scene.ellipsoid(Vector3f::Zero(), {0.28F, 0.19F, 0.105F}, 8, cloth);
    }
  }
}

void add_rock(Scene& scene, float size_m, SeededRandom& random) {
  const Scene::Object object(scene);
  const float shade = random.uniform(0.6F, 1.0F);
  const auto stone = scene.paint(
      SurfaceClass::kTerrain, kConcrete,
      shade > 0.8F ? Vector3f(0.8F, 0.76F, 0.7F) : Vector3f(0.55F, 0.55F, 0.56F), 0.37F);
  const auto seed = static_cast<std::uint64_t>(random.below(1 << 30));
  const Vector3f radii = size_m * Vector3f(random.uniform(0.4F, 0.6F), random.uniform(0.35F, 0.5F),
                                           random.uniform(0.25F, 0.45F));
  constexpr int kRows = 8;
  constexpr int kColumns = 14;
  const auto point = [&](float row, int column) {
    const float latitude = kPi * (row / kRows - 0.5F);
    const float angle = 2.0F * kPi * static_cast<float>(column % kColumns) / kColumns;
    const Vector3f unit(std::cos(latitude) * std::cos(angle), std::cos(latitude) * std::sin(angle),
                        std::sin(latitude));
    const Vector3f lumps = 3.0F * unit;
    const float radius = 1.0F + 0.22F * ground_noise(lumps.x() + lumps.z(), lumps.y(), 1.3F, seed) +
                         0.1F * ground_noise(lumps.x(), lumps.y() - lumps.z(), 0.6F, seed);
    return Vector3f(radius * radii.cwiseProduct(unit));
  };
  scene.sheet(kRows, kColumns, point, stone);
}

void add_barrier(Scene& scene) {
  const Scene::Object object(scene);
  const auto concrete = scene.paint(kObjectLabel, kConcrete, Vector3f::Ones(), 0.6F);
  const Vector2f outline[] = {{-0.3F, -0.2F}, {0.3F, -0.2F},   {0.3F, 0.1F},   {0.1F, 0.35F},
                              {0.08F, 0.82F}, {-0.08F, 0.82F}, {-0.1F, 0.35F}, {-0.3F, 0.1F}};
  // The section is in the plane (y, z): the extrusion's axis becomes x.
  Eigen::Isometry3f turned = Eigen::Isometry3f::Identity();
  turned.linear() << 0, 0, 1, 1, 0, 0, 0, 1, 0;
  const auto frame = scene.at(turned);
  scene.extrude(outline, -1.5F, 1.5F, concrete);
}

void add_generator(Scene& scene, SeededRandom& random) {
  const Scene::Object object(scene);
  const auto skin = random.chance(0.5)
                        ? scene.paint(kObjectLabel, kPaintedMetal, {0.6F, 0.42F, 0.05F})
                        : scene.paint(kObjectLabel, kPaintedMetal, {0.2F, 0.22F, 0.12F});
  const auto dark = scene.plain(kObjectLabel, {0.03F, 0.03F, 0.03F});
  scene.box({-1.3F, -0.55F, 0.12F}, {1.3F, 0.55F, 1.5F}, skin);
  scene.box({-1.35F, -0.5F, -0.2F}, {1.35F, 0.5F, 0.12F}, dark);
  for (float slat = 0; slat < 8; ++slat) {
    const float z = 0.45F + 0.1F * slat;
    scene.box({-1.1F, -0.56F, z}, {-0.2F, -0.54F, z + 0.05F}, dark);
  }
  scene.box({0.2F, -0.565F, 0.7F}, {1.0F, -0.55F, 1.2F},
            scene.plain(kObjectLabel, {0.6F, 0.6F, 0.58F}));
  scene.cylinder({0.9F, 0.2F, 1.5F}, {0.9F, 0.2F, 1.95F}, 0.06F, 0.06F, 10, dark);
}

void add_toilet_cabin(Scene& scene, SeededRandom& random) {
  const Scene::Object object(scene);
  const auto skin = random.chance(0.6) ? scene.plain(kObjectLabel, {0.06F, 0.2F, 0.36F})
                                       : scene.plain(kObjectLabel, {0.1F, 0.28F, 0.14F});
  const auto light = scene.plain(kObjectLabel, {0.72F, 0.72F, 0.7F});
  scene.box({-0.55F, -0.55F, -0.15F}, {0.55F, 0.55F, 2.15F}, skin, kSidesNoBottom);
  scene.box({-0.6F, -0.6F, 2.15F}, {0.6F, 0.6F, 2.28F}, light);
  scene.box({-0.42F, -0.575F, 0.1F}, {0.42F, -0.55F, 2.02F}, skin);
  scene.box({-0.36F, -0.585F, 1.6F}, {0.36F, -0.575F, 1.9F}, light);
  scene.box({0.28F, -0.59F, 1.0F}, {0.38F, -0.575F, 1.12F}, light);
  for (const float x : {-0.5F, -0.2F, 0.1F, 0.4F})
    scene.box({x, 0.55F, 0.1F}, {x + 0.08F, 0.57F, 2.1F}, skin);
}

void add_water_tank(Scene& scene, SeededRandom& random) {
  const Scene::Object object(scene);
  const auto skin =
      scene.paint(kObjectLabel, kPaintedMetal,
                  random.chance(0.5) ? Vector3f(0.22F, 0.24F, 0.14F) : Vector3f(0.5F, 0.5F, 0.48F));
  const auto dark = scene.plain(kObjectLabel, {0.04F, 0.04F, 0.04F});
  scene.cylinder({-1.5F, 0, 1.35F}, {1.5F, 0, 1.35F}, 0.75F, 0.75F, 22, skin);
  for (const float x : {-1.2F, 0.0F, 1.2F})
    scene.cylinder({x - 0.03F, 0, 1.35F}, {x + 0.03F, 0, 1.35F}, 0.77F, 0.77F, 22, dark);
  for (const float x : {-1.1F, 1.1F})
    for (const float y : {-0.55F, 0.55F})
      scene.box({x - 0.06F, y - 0.06F, -0.3F}, {x + 0.06F, y + 0.06F, 1.0F}, dark);
  scene.cylinder({0, 0, 2.05F}, {0, 0, 2.2F}, 0.25F, 0.25F, 14, dark);
}

void add_log_pile(Scene& scene, SeededRandom& random) {
  const Scene::Object object(scene);
  const auto bark = scene.paint(kObjectLabel, kBark);
  constexpr float kRadius = 0.16F;
  for (int layer = 0; layer < 4; ++layer) {
    for (int i = 0; i < 6 - layer; ++i) {
      const float y =
          2.0F * kRadius * (static_cast<float>(i) + 0.5F * static_cast<float>(layer)) - 0.8F;
      const float z = kRadius * (0.9F + 1.72F * static_cast<float>(layer));
      const float shift = random.uniform(-0.15F, 0.15F);
      scene.cylinder({-1.3F + shift, y, z}, {1.3F + shift, y, z},
                     kRadius * random.uniform(0.85F, 1.0F), kRadius, 10, bark);
    }
  }
}

}  // namespace km
