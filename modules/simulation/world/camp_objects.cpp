#include "modules/simulation/world/camp_objects.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "modules/simulation/world/openings.hpp"
#include "modules/simulation/world/terrain.hpp"

namespace km {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

constexpr float kPi = std::numbers::pi_v<float>;
constexpr SurfaceClass kLabel = SurfaceClass::kObject;

MaterialId wood(Scene& scene) {
  return scene.paint(kLabel, Recipe::kWoodPlanks, {0.85F, 0.75F, 0.6F});
}

void add_container_doors(Scene& scene, float x, const Vector3f& half, MaterialId skin,
                         MaterialId steel) {
  MeshBuilder& mesh = scene.mesh;
  for (const float side : {-1.0F, 1.0F}) {
    const float y0 = std::min(side * 0.03F, side * (half.y() - 0.12F));
    const float y1 = std::max(side * 0.03F, side * (half.y() - 0.12F));
    mesh.box({x - 0.04F, y0, 0.16F}, {x + 0.02F, y1, 2.0F * half.z() - 0.14F}, skin);
    for (const float bar : {0.28F, 0.85F}) {
      const float y = side * bar * half.y();
      mesh.cylinder({x + 0.05F, y, 0.12F}, {x + 0.05F, y, 2.0F * half.z() - 0.1F}, 0.022F, 0.022F,
                    6, steel, false);
      mesh.box({x + 0.02F, y - 0.14F, 1.05F}, {x + 0.09F, y + 0.14F, 1.1F}, steel);
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
    if (side < 0.0F) {
      scene.mesh.quad({xa, ya, z0}, {xb, yb, z0}, {xb, yb, z1}, {xa, ya, z1}, skin);
    } else {
      scene.mesh.quad({xb, yb, z0}, {xa, ya, z0}, {xa, ya, z1}, {xb, yb, z1}, skin);
    }
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

void add_container(Scene& scene, SeededRandom& random) {
  static constexpr std::array<std::array<float, 3>, 6> kTints = {{{0.2F, 0.22F, 0.12F},
                                                                  {0.42F, 0.1F, 0.06F},
                                                                  {0.06F, 0.15F, 0.3F},
                                                                  {0.55F, 0.53F, 0.48F},
                                                                  {0.5F, 0.42F, 0.26F},
                                                                  {0.1F, 0.24F, 0.16F}}};
  const auto& [red, green, blue] = kTints[static_cast<std::size_t>(random.below(kTints.size()))];
  const bool bland = random.chance(0.25);
  const MaterialId skin =
      scene.paint(kLabel, bland ? Recipe::kPlain : Recipe::kPaintedMetal, {red, green, blue});
  const MaterialId steel =
      scene.paint(kLabel, Recipe::kPaintedMetal, {0.7F * red, 0.7F * green, 0.7F * blue});
  MeshBuilder& mesh = scene.mesh;
  const Vector3f half(3.03F, 1.22F, 1.295F);
  const float top = 2.0F * half.z();
  for (const float side : {-1.0F, 1.0F}) {
    if (bland) {
      const float y = side * (half.y() - 0.02F);
      mesh.box({-half.x() + 0.05F, std::min(y, 0.9F * y), 0.12F},
               {half.x() - 0.05F, std::max(y, 0.9F * y), top - 0.08F}, skin);
    } else {
      add_corrugated_wall(scene, half.x() - 0.08F, side * (half.y() - 0.015F), side, 0.12F,
                          top - 0.08F, skin);
    }
    const float y0 = side > 0.0F ? half.y() - 0.1F : -half.y();
    mesh.box({-half.x(), y0, -0.25F}, {half.x(), y0 + 0.1F, 0.14F}, steel);
    mesh.box({-half.x(), y0, top - 0.1F}, {half.x(), y0 + 0.1F, top}, steel);
    for (const float x : {-half.x(), half.x() - 0.12F}) {
      mesh.box({x, y0, 0.0F}, {x + 0.12F, y0 + 0.1F, top + 0.01F}, steel);
    }
  }
  mesh.box({-half.x() + 0.02F, -half.y() + 0.05F, top - 0.06F},
           {half.x() - 0.02F, half.y() - 0.05F, top - 0.02F}, skin);
  mesh.box({-half.x() + 0.01F, -half.y() + 0.05F, 0.05F},
           {-half.x() + 0.06F, half.y() - 0.05F, top}, skin);
  add_container_doors(scene, half.x() - 0.03F, half, skin, steel);
  if (random.chance(0.5)) {  // the owner's mark
    const ScopedFrame wall(mesh, standing_at({-1.2F, -half.y() - 0.0F, 0.0F}, 0.0F));
    add_sign_board(scene, 0.0F, 1.55F, 2.0F, 0.42F, kLabel, random);
  }
}

void add_crates(Scene& scene, SeededRandom& random) {
  const MaterialId boards = random.chance(0.5)
                                ? wood(scene)
                                : scene.paint(kLabel, Recipe::kWoodPlanks, {0.38F, 0.42F, 0.26F});
  const MaterialId batten = wood(scene);
  MeshBuilder& mesh = scene.mesh;
  const int count = 2 + random.below(4);
  for (int i = 0; i < count; ++i) {
    const bool upper = i >= 3;
    const Vector3f at(static_cast<float>(i % 3) * 1.05F - 1.05F, random.uniform(-0.15F, 0.15F),
                      upper ? 0.82F : -0.05F);
    const ScopedFrame frame(mesh, standing_at(at, random.uniform(-0.15F, 0.15F)));
    const float w = 0.48F;
    const float h = upper ? 0.6F : 0.87F;
    mesh.box({-w, -0.38F, 0.0F}, {w, 0.38F, h}, boards);
    for (const float x : {-w - 0.02F, w - 0.06F}) {
      for (const float y : {-0.4F, 0.36F}) {
        mesh.box({x, y, 0.0F}, {x + 0.08F, y + 0.04F, h + 0.01F}, batten);
      }
    }
    for (const float z : {0.04F, h - 0.1F}) {
      mesh.box({-w, -0.4F, z}, {w, -0.38F, z + 0.08F}, batten);
      mesh.box({-w, 0.38F, z}, {w, 0.4F, z + 0.08F}, batten);
    }
  }
}

void add_barrels(Scene& scene, SeededRandom& random) {
  static constexpr std::array<std::array<float, 3>, 4> kTints = {
      {{0.06F, 0.16F, 0.36F}, {0.22F, 0.24F, 0.13F}, {0.45F, 0.1F, 0.05F}, {0.3F, 0.3F, 0.3F}}};
  MeshBuilder& mesh = scene.mesh;
  const int count = 2 + random.below(5);
  for (int i = 0; i < count; ++i) {
    const auto& [red, green, blue] = kTints[static_cast<std::size_t>(random.below(kTints.size()))];
    const MaterialId skin = scene.paint(kLabel, Recipe::kPaintedMetal, {red, green, blue});
    const ScopedFrame frame(
        mesh, standing_at({0.66F * static_cast<float>(i % 3) + random.uniform(-0.03F, 0.03F),
                           0.64F * static_cast<float>(i / 3), 0.0F},
                          random.uniform(0.0F, 6.0F)));
    const float r = 0.29F;
    const std::array<Vector2f, 9> profile = {{{r, -0.1F},
                                              {r, 0.28F},
                                              {r + 0.015F, 0.3F},
                                              {r, 0.32F},
                                              {r, 0.57F},
                                              {r + 0.015F, 0.59F},
                                              {r, 0.61F},
                                              {r, 0.88F},
                                              {r - 0.02F, 0.89F}}};
    mesh.revolve(profile, 16, skin);
    mesh.cylinder({0, 0, 0.8F}, {0, 0, 0.87F}, r - 0.01F, r - 0.01F, 16, skin);
  }
}

void add_sandbags(Scene& scene, float length_m, SeededRandom& random) {
  const MaterialId cloth = scene.paint(kLabel, Recipe::kCanvas, {0.5F, 0.42F, 0.28F}, 0.3F);
  const int bags = std::max(1, static_cast<int>(length_m / 0.5F));
  for (int layer = 0; layer < 5; ++layer) {
    for (int bag = 0; bag < bags; ++bag) {
      const float x = 0.5F * (static_cast<float>(bag) + (layer % 2 == 0 ? 0.25F : 0.5F));
      const Vector3f at(x, random.uniform(-0.03F, 0.03F),
                        0.04F + 0.16F * static_cast<float>(layer));
      const ScopedFrame frame(scene.mesh, standing_at(at, random.uniform(-0.12F, 0.12F)));
      scene.mesh.ellipsoid(Vector3f::Zero(), {0.28F, 0.19F, 0.105F}, 8, cloth);
    }
  }
}

void add_rock(Scene& scene, float size_m, SeededRandom& random) {
  const float shade = random.uniform(0.6F, 1.0F);
  const MaterialId stone = scene.paint(
      SurfaceClass::kTerrain, Recipe::kConcrete,
      shade > 0.8F ? Vector3f(0.8F, 0.76F, 0.7F) : Vector3f(0.55F, 0.55F, 0.56F), 0.37F);
  const auto seed = static_cast<std::uint64_t>(random.below(1 << 30));
  const Vector3f radii = size_m * Vector3f(random.uniform(0.4F, 0.6F), random.uniform(0.35F, 0.5F),
                                           random.uniform(0.25F, 0.45F));
  constexpr int kRows = 8;
  constexpr int kColumns = 14;
  scene.mesh.sheet(
      kRows, kColumns,
      [&](int row, int column) {
        const float latitude = kPi * (static_cast<float>(row) / kRows - 0.5F);
        const float angle = 2.0F * kPi * static_cast<float>(column % kColumns) / kColumns;
        const Vector3f unit(std::cos(latitude) * std::cos(angle),
                            std::cos(latitude) * std::sin(angle), std::sin(latitude));
        const Vector3f lumps = 3.0F * unit;
        const float radius = 1.0F +
                             0.22F * ground_noise(lumps.x() + lumps.z(), lumps.y(), 1.3F, seed) +
                             0.1F * ground_noise(lumps.x(), lumps.y() - lumps.z(), 0.6F, seed);
        return Vector3f(radius * radii.cwiseProduct(unit));
      },
      stone);
}

void add_barrier(Scene& scene) {
  const MaterialId concrete = scene.paint(kLabel, Recipe::kConcrete, Vector3f::Ones(), 0.6F);
  const std::array<Vector2f, 8> outline = {{{-0.3F, -0.2F},
                                            {0.3F, -0.2F},
                                            {0.3F, 0.1F},
                                            {0.1F, 0.35F},
                                            {0.08F, 0.82F},
                                            {-0.08F, 0.82F},
                                            {-0.1F, 0.35F},
                                            {-0.3F, 0.1F}}};
  // The section stands in (y, z): the extrusion's axis turns to x.
  Eigen::Isometry3f turned = Eigen::Isometry3f::Identity();
  turned.linear() << 0, 0, 1, 1, 0, 0, 0, 1, 0;
  const ScopedFrame frame(scene.mesh, turned);
  scene.mesh.extrude(outline, -1.5F, 1.5F, concrete);
}

void add_generator(Scene& scene, SeededRandom& random) {
  const MaterialId skin = random.chance(0.5)
                              ? scene.paint(kLabel, Recipe::kPaintedMetal, {0.6F, 0.42F, 0.05F})
                              : scene.paint(kLabel, Recipe::kPaintedMetal, {0.2F, 0.22F, 0.12F});
  const MaterialId dark = scene.plain(kLabel, 0.03F, 0.03F, 0.03F);
  MeshBuilder& mesh = scene.mesh;
  mesh.box({-1.3F, -0.55F, 0.12F}, {1.3F, 0.55F, 1.5F}, skin);
  mesh.box({-1.35F, -0.5F, -0.2F}, {1.35F, 0.5F, 0.12F}, dark);
  for (int slat = 0; slat < 8; ++slat) {
    const float z = 0.45F + 0.1F * static_cast<float>(slat);
    mesh.box({-1.1F, -0.56F, z}, {-0.2F, -0.54F, z + 0.05F}, dark);
  }
  mesh.box({0.2F, -0.565F, 0.7F}, {1.0F, -0.55F, 1.2F}, scene.plain(kLabel, 0.6F, 0.6F, 0.58F));
  mesh.cylinder({0.9F, 0.2F, 1.5F}, {0.9F, 0.2F, 1.95F}, 0.06F, 0.06F, 10, dark);
}

void add_toilet_cabin(Scene& scene, SeededRandom& random) {
  const MaterialId skin = random.chance(0.6) ? scene.plain(kLabel, 0.06F, 0.2F, 0.36F)
                                             : scene.plain(kLabel, 0.1F, 0.28F, 0.14F);
  const MaterialId light = scene.plain(kLabel, 0.72F, 0.72F, 0.7F);
  MeshBuilder& mesh = scene.mesh;
  mesh.box({-0.55F, -0.55F, -0.15F}, {0.55F, 0.55F, 2.15F}, skin, kSidesNoBottom);
  mesh.box({-0.6F, -0.6F, 2.15F}, {0.6F, 0.6F, 2.28F}, light);
  mesh.box({-0.42F, -0.575F, 0.1F}, {0.42F, -0.55F, 2.02F}, skin);
  mesh.box({-0.36F, -0.585F, 1.6F}, {0.36F, -0.575F, 1.9F}, light);
  mesh.box({0.28F, -0.59F, 1.0F}, {0.38F, -0.575F, 1.12F}, light);
  for (const float x : {-0.5F, -0.2F, 0.1F, 0.4F}) {
    mesh.box({x, 0.55F, 0.1F}, {x + 0.08F, 0.57F, 2.1F}, skin);
  }
}

void add_water_tank(Scene& scene, SeededRandom& random) {
  const MaterialId skin =
      scene.paint(kLabel, Recipe::kPaintedMetal,
                  random.chance(0.5) ? Vector3f(0.22F, 0.24F, 0.14F) : Vector3f(0.5F, 0.5F, 0.48F));
  const MaterialId dark = scene.plain(kLabel, 0.04F, 0.04F, 0.04F);
  MeshBuilder& mesh = scene.mesh;
  mesh.cylinder({-1.5F, 0, 1.35F}, {1.5F, 0, 1.35F}, 0.75F, 0.75F, 22, skin);
  for (const float x : {-1.2F, 0.0F, 1.2F}) {
    mesh.cylinder({x - 0.03F, 0, 1.35F}, {x + 0.03F, 0, 1.35F}, 0.77F, 0.77F, 22, dark);
  }
  for (const float x : {-1.1F, 1.1F}) {
    for (const float y : {-0.55F, 0.55F}) {
      mesh.box({x - 0.06F, y - 0.06F, -0.3F}, {x + 0.06F, y + 0.06F, 1.0F}, dark);
    }
  }
  mesh.cylinder({0, 0, 2.05F}, {0, 0, 2.2F}, 0.25F, 0.25F, 14, dark);
}

void add_log_pile(Scene& scene, SeededRandom& random) {
  const MaterialId bark = scene.paint(kLabel, Recipe::kBark);
  constexpr float kRadius = 0.16F;
  for (int layer = 0; layer < 4; ++layer) {
    for (int i = 0; i < 6 - layer; ++i) {
      const float y =
          2.0F * kRadius * (static_cast<float>(i) + 0.5F * static_cast<float>(layer)) - 0.8F;
      const float z = kRadius * (0.9F + 1.72F * static_cast<float>(layer));
      const float shift = random.uniform(-0.15F, 0.15F);
      scene.mesh.cylinder({-1.3F + shift, y, z}, {1.3F + shift, y, z},
                          kRadius * random.uniform(0.85F, 1.0F), kRadius, 10, bark);
    }
  }
}

}  // namespace km
