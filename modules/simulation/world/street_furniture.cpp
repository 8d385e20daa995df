#include "modules/simulation/world/street_furniture.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "modules/simulation/world/openings.hpp"

namespace km {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

constexpr float kPi = std::numbers::pi_v<float>;

MaterialId iron(Scene& scene, SurfaceClass label) {
  return scene.plain(label, 0.06F, 0.065F, 0.07F, 0.05F);
}

/// Regular polygon around the origin, counter-clockwise, first corner at `turn`.
std::vector<Vector2f> regular(int corners, float radius, float turn) {
  std::vector<Vector2f> outline;
  for (int i = 0; i < corners; ++i) {
    const float angle = turn + 2.0F * kPi * static_cast<float>(i) / static_cast<float>(corners);
    outline.emplace_back(radius * std::cos(angle), radius * std::sin(angle));
  }
  return outline;
}

/// A plate with a coloured rim that faces -y, its middle at height z.
void add_plate(Scene& scene, int corners, float radius, float turn, float z, MaterialId rim,
               MaterialId field) {
  Eigen::Isometry3f upright = Eigen::Isometry3f::Identity();
  upright.linear() = Eigen::AngleAxisf(0.5F * kPi, Vector3f::UnitX()).toRotationMatrix();
  upright.translation() = Vector3f(0.0F, -0.04F, z);
  const ScopedFrame frame(scene.mesh, upright);  // its z points to -y
  scene.mesh.extrude(regular(corners, radius, turn), 0.0F, 0.02F, rim);
  scene.mesh.polygon(regular(corners, 0.78F * radius, turn), 0.024F, field);
}

void add_bars(Scene& scene, float x0, float x1, float pitch, float half, float z0, float z1,
              MaterialId material) {
  const int count = std::max(1, static_cast<int>((x1 - x0) / pitch));
  for (int i = 0; i < count; ++i) {
    const float x = x0 + (x1 - x0) * (static_cast<float>(i) + 0.5F) / static_cast<float>(count);
    scene.mesh.box({x - half, -half, z0}, {x + half, half, z1}, material, kSidesNoBottom);
  }
}

}  // namespace

void add_street_lamp(Scene& scene, SeededRandom& random) {
  MeshBuilder& mesh = scene.mesh;
  const MaterialId post = iron(scene, SurfaceClass::kPole);
  const MaterialId lens = scene.plain(SurfaceClass::kPole, 0.85F, 0.84F, 0.78F, 0.1F);
  const float height = 5.5F;
  const std::array<Vector2f, 6> foot = {{{0.14F, -0.1F},
                                         {0.14F, 0.35F},
                                         {0.1F, 0.42F},
                                         {0.085F, 0.9F},
                                         {0.065F, 1.0F},
                                         {0.05F, height}}};
  mesh.revolve(foot, 12, post);
  if (random.chance(0.5)) {
    mesh.cylinder({0, 0, height - 0.1F}, {0, -0.7F, height + 0.25F}, 0.04F, 0.035F, 8, post);
    mesh.cylinder({0, -0.7F, height + 0.25F}, {0, -1.3F, height + 0.28F}, 0.035F, 0.035F, 8, post);
    mesh.ellipsoid({0, -1.5F, height + 0.27F}, {0.14F, 0.36F, 0.09F}, 12, post);
    mesh.ellipsoid({0, -1.52F, height + 0.22F}, {0.1F, 0.27F, 0.07F}, 12, lens);
  } else {
    const std::array<Vector2f, 5> lantern = {{{0.05F, height},
                                              {0.1F, height + 0.05F},
                                              {0.2F, height + 0.55F},
                                              {0.26F, height + 0.57F},
                                              {0.0F, height + 0.85F}}};
    mesh.revolve(std::span(lantern).first(3), 8, lens);
    mesh.revolve(std::span(lantern).last(3), 8, post);
  }
}

void add_traffic_sign(Scene& scene, SeededRandom& random) {
  MeshBuilder& mesh = scene.mesh;
  constexpr SurfaceClass kLabel = SurfaceClass::kPole;
  const MaterialId pole = scene.plain(kLabel, 0.4F, 0.41F, 0.42F, 0.1F);
  const MaterialId red = scene.plain(kLabel, 0.55F, 0.03F, 0.03F);
  const MaterialId white = scene.plain(kLabel, 0.82F, 0.82F, 0.8F);
  const MaterialId blue = scene.plain(kLabel, 0.03F, 0.13F, 0.5F);
  const MaterialId black = scene.plain(kLabel, 0.03F, 0.03F, 0.03F);
  const float z = random.uniform(2.3F, 2.6F);
  mesh.cylinder({0, 0, -0.1F}, {0, 0, z + 0.4F}, 0.035F, 0.035F, 8, pole);
  switch (random.below(5)) {
    case 0:
      add_plate(scene, 20, 0.33F, 0.0F, z, red, white);
      mesh.box({-0.16F, -0.075F, z - 0.09F}, {-0.04F, -0.064F, z + 0.1F}, black);
      mesh.box({0.03F, -0.075F, z - 0.09F}, {0.16F, -0.064F, z + 0.1F}, black);
      break;
    case 1:
      add_plate(scene, 3, 0.45F, 0.5F * kPi, z, red, white);
      mesh.box({-0.03F, -0.075F, z - 0.08F}, {0.03F, -0.064F, z + 0.16F}, black);
      break;
    case 2:
      add_plate(scene, 20, 0.33F, 0.0F, z, white, blue);
      mesh.box({-0.04F, -0.075F, z - 0.17F}, {0.04F, -0.064F, z + 0.17F}, white);
      break;
    case 3:
      add_plate(scene, 8, 0.38F, 0.125F * kPi, z, white, red);
      mesh.box({-0.24F, -0.075F, z - 0.07F}, {0.24F, -0.064F, z + 0.07F}, white);
      break;
    default: {
      const ScopedFrame board(mesh, standing_at({-0.5F, -0.04F, 0.0F}, 0.0F));
      add_sign_board(scene, 0.0F, z, 1.0F, 0.22F, kLabel, random);
    }
  }
  if (random.chance(0.3)) {
    mesh.box({-0.26F, -0.06F, z - 0.68F}, {0.26F, -0.04F, z - 0.48F}, white);
    mesh.box({-0.2F, -0.064F, z - 0.61F}, {0.16F, -0.06F, z - 0.56F}, black);
  }
}

void add_traffic_light(Scene& scene) {
  MeshBuilder& mesh = scene.mesh;
  constexpr SurfaceClass kLabel = SurfaceClass::kPole;
  const MaterialId post = iron(scene, kLabel);
  mesh.cylinder({0, 0, -0.1F}, {0, 0, 3.3F}, 0.06F, 0.055F, 10, post);
  mesh.box({-0.15F, -0.2F, 2.35F}, {0.15F, 0.02F, 3.25F}, post);
  const std::array<MaterialId, 3> lamps = {scene.plain(kLabel, 0.06F, 0.3F, 0.1F, 0.15F),
                                           scene.plain(kLabel, 0.35F, 0.2F, 0.03F, 0.15F),
                                           scene.plain(kLabel, 0.7F, 0.05F, 0.04F, 0.15F)};
  for (std::size_t i = 0; i < lamps.size(); ++i) {
    const float z = 2.5F + 0.3F * static_cast<float>(i);
    mesh.cylinder({0, -0.2F, z}, {0, -0.21F, z}, 0.1F, 0.1F, 14, lamps[i]);
    mesh.cylinder({0, -0.36F, z + 0.04F}, {0, -0.2F, z + 0.02F}, 0.12F, 0.12F, 14, post, false);
  }
}

void add_bench(Scene& scene) {
  MeshBuilder& mesh = scene.mesh;
  constexpr SurfaceClass kLabel = SurfaceClass::kObject;
  const MaterialId wood = scene.paint(kLabel, Recipe::kWoodPlanks, {0.9F, 0.75F, 0.55F});
  const MaterialId metal = iron(scene, kLabel);
  for (const float x : {-0.75F, 0.7F}) {
    mesh.box({x, -0.22F, -0.05F}, {x + 0.05F, -0.17F, 0.42F}, metal);
    mesh.box({x, 0.17F, -0.05F}, {x + 0.05F, 0.22F, 0.85F}, metal);
    mesh.box({x, -0.22F, 0.38F}, {x + 0.05F, 0.2F, 0.42F}, metal);
  }
  for (int slat = 0; slat < 4; ++slat) {
    const float y = -0.24F + 0.11F * static_cast<float>(slat);
    mesh.box({-0.9F, y, 0.42F}, {0.9F, y + 0.09F, 0.455F}, wood);
  }
  for (int slat = 0; slat < 3; ++slat) {
    const float z = 0.52F + 0.12F * static_cast<float>(slat);
    mesh.box({-0.9F, 0.13F, z}, {0.9F, 0.17F, z + 0.09F}, wood);
  }
}

void add_bin(Scene& scene, SeededRandom& random) {
  constexpr SurfaceClass kLabel = SurfaceClass::kObject;
  MeshBuilder& mesh = scene.mesh;
  if (random.chance(0.5)) {  // a wheeled bin
    static constexpr std::array<std::array<float, 3>, 3> kTints = {
        {{0.05F, 0.06F, 0.06F}, {0.05F, 0.16F, 0.07F}, {0.35F, 0.28F, 0.04F}}};
    const auto& [red, green, blue] = kTints[static_cast<std::size_t>(random.below(3))];
    const MaterialId body = scene.plain(kLabel, red, green, blue);
    mesh.box({-0.26F, -0.3F, 0.06F}, {0.26F, 0.3F, 0.95F}, body);
    mesh.box({-0.29F, -0.36F, 0.95F}, {0.29F, 0.32F, 1.03F}, body);
    mesh.cylinder({-0.28F, 0.26F, 0.1F}, {0.28F, 0.26F, 0.1F}, 0.1F, 0.1F, 10, iron(scene, kLabel));
    return;
  }
  const MaterialId body = scene.paint(kLabel, Recipe::kPaintedMetal, {0.12F, 0.2F, 0.14F});
  const std::array<Vector2f, 4> profile = {
      {{0.2F, 0.0F}, {0.24F, 0.75F}, {0.27F, 0.78F}, {0.18F, 0.9F}}};
  mesh.revolve(profile, 14, body);
  mesh.cylinder({0, 0, 0.84F}, {0, 0, 0.86F}, 0.2F, 0.2F, 14, iron(scene, kLabel));
}

void add_bollard(Scene& scene) {
  const MaterialId post = iron(scene, SurfaceClass::kPole);
  const MaterialId band = scene.plain(SurfaceClass::kPole, 0.8F, 0.8F, 0.78F);
  scene.mesh.cylinder({0, 0, -0.1F}, {0, 0, 0.9F}, 0.06F, 0.055F, 10, post);
  scene.mesh.cylinder({0, 0, 0.72F}, {0, 0, 0.82F}, 0.062F, 0.062F, 10, band);
  scene.mesh.ellipsoid({0, 0, 0.92F}, {0.07F, 0.07F, 0.07F}, 10, post);
}

void add_hydrant(Scene& scene) {
  const MaterialId red =
      scene.paint(SurfaceClass::kObject, Recipe::kPaintedMetal, {0.6F, 0.07F, 0.05F});
  const std::array<Vector2f, 6> profile = {{{0.16F, -0.05F},
                                            {0.16F, 0.06F},
                                            {0.11F, 0.08F},
                                            {0.11F, 0.55F},
                                            {0.15F, 0.58F},
                                            {0.0F, 0.78F}}};
  scene.mesh.revolve(profile, 12, red);
  scene.mesh.cylinder({-0.22F, 0, 0.42F}, {0.22F, 0, 0.42F}, 0.06F, 0.06F, 10, red);
}

void add_mail_box(Scene& scene, SeededRandom& random) {
  constexpr SurfaceClass kLabel = SurfaceClass::kObject;
  const MaterialId body = random.chance(0.5) ? scene.plain(kLabel, 0.65F, 0.5F, 0.04F)
                                             : scene.plain(kLabel, 0.5F, 0.04F, 0.04F);
  const MaterialId dark = iron(scene, kLabel);
  scene.mesh.box({-0.06F, -0.06F, -0.05F}, {0.06F, 0.06F, 0.75F}, dark);
  scene.mesh.box({-0.27F, -0.2F, 0.72F}, {0.27F, 0.2F, 1.3F}, body);
  scene.mesh.cylinder({-0.27F, 0, 1.3F}, {0.27F, 0, 1.3F}, 0.2F, 0.2F, 14, body);
  scene.mesh.box({-0.18F, -0.215F, 1.14F}, {0.18F, -0.2F, 1.19F}, dark);
  scene.mesh.box({-0.14F, -0.206F, 0.85F}, {0.14F, -0.2F, 1.02F},
                 scene.plain(kLabel, 0.8F, 0.8F, 0.78F));
}

void add_advertising_column(Scene& scene, SeededRandom& random) {
  constexpr SurfaceClass kLabel = SurfaceClass::kObject;
  const MaterialId prints = scene.paint(kLabel, Recipe::kPosters);
  const MaterialId rim = scene.paint(kLabel, Recipe::kPaintedMetal, {0.1F, 0.18F, 0.12F});
  scene.mesh.set_uv_offset(
      {static_cast<float>(random.below(4)), static_cast<float>(random.below(4))});
  scene.mesh.cylinder({0, 0, 0.3F}, {0, 0, 2.9F}, 0.637F, 0.637F, 28, prints, false);
  scene.mesh.set_uv_offset(Vector2f::Zero());
  scene.mesh.cylinder({0, 0, -0.1F}, {0, 0, 0.3F}, 0.7F, 0.68F, 28, rim);
  const std::array<Vector2f, 4> cap = {
      {{0.64F, 2.88F}, {0.78F, 2.95F}, {0.74F, 3.1F}, {0.0F, 3.7F}}};
  scene.mesh.revolve(cap, 28, rim);
}

void add_planter(Scene& scene, SeededRandom& random) {
  const MaterialId stone =
      scene.paint(SurfaceClass::kObject, Recipe::kConcrete, {0.9F, 0.9F, 0.86F});
  const MaterialId soil = scene.paint(SurfaceClass::kTerrain, Recipe::kSoil);
  const MaterialId leaves =
      scene.paint(SurfaceClass::kVegetation, Recipe::kLeaves, {1.1F, 1.1F, 0.9F});
  MeshBuilder& mesh = scene.mesh;
  mesh.box({-0.8F, -0.35F, -0.05F}, {0.8F, 0.35F, 0.5F}, stone, kSidesAround);
  mesh.box({-0.84F, -0.39F, 0.5F}, {0.84F, 0.39F, 0.56F}, stone);
  mesh.quad({-0.75F, -0.3F, 0.57F}, {0.75F, -0.3F, 0.57F}, {0.75F, 0.3F, 0.57F},
            {-0.75F, 0.3F, 0.57F}, soil);
  for (const float x : {-0.5F, 0.0F, 0.5F}) {
    const float r = random.uniform(0.25F, 0.38F);
    mesh.leaf_cluster({x, 0, 0.5F + 0.8F * r}, {r, 0.8F * r, r}, 90, 0.16F, leaves, random);
  }
}

void add_railing(Scene& scene, float length_m, float height_m) {
  const MaterialId bar = iron(scene, SurfaceClass::kFence);
  const MaterialId stone = scene.paint(SurfaceClass::kFence, Recipe::kConcrete);
  MeshBuilder& mesh = scene.mesh;
  mesh.box({0, -0.12F, -0.1F}, {length_m, 0.12F, 0.3F}, stone, kSidesNoBottom);
  for (const float z : {0.42F, height_m - 0.15F}) {
    mesh.box({0, -0.02F, z}, {length_m, 0.02F, z + 0.04F}, bar);
  }
  add_bars(scene, 0.0F, length_m, 0.14F, 0.011F, 0.3F, height_m, bar);
  add_bars(scene, 0.0F, length_m, 2.4F, 0.04F, 0.3F, height_m + 0.1F, bar);
}

void add_plank_fence(Scene& scene, float length_m, float height_m) {
  const MaterialId wood =
      scene.paint(SurfaceClass::kFence, Recipe::kWoodPlanks, {0.85F, 0.8F, 0.75F});
  MeshBuilder& mesh = scene.mesh;
  const int boards = std::max(1, static_cast<int>(length_m / 0.16F));
  const float pitch = length_m / static_cast<float>(boards);
  for (int i = 0; i < boards; ++i) {
    const float x = pitch * static_cast<float>(i);
    const float top = height_m - 0.02F * static_cast<float>(i * 7 % 3);
    mesh.box({x + 0.008F, -0.02F, 0.06F}, {x + pitch - 0.008F, 0.0F, top}, wood, kSidesNoBottom);
  }
  for (const float z : {0.35F, height_m - 0.4F}) {
    mesh.box({0, 0.0F, z}, {length_m, 0.05F, z + 0.09F}, wood);
  }
  for (float x = 0.2F; x < length_m; x += 2.2F) {
    mesh.box({x, 0.04F, -0.2F}, {x + 0.09F, 0.13F, height_m}, wood);
  }
}

void add_wire_fence(Scene& scene, float length_m, float height_m) {
  constexpr SurfaceClass kLabel = SurfaceClass::kFence;
  const MaterialId steel = scene.plain(kLabel, 0.36F, 0.37F, 0.37F, 0.1F);
  MeshBuilder& mesh = scene.mesh;
  for (float x = 0.05F; x < length_m; x += 2.5F) {
    mesh.cylinder({x, 0, -0.3F}, {x, 0, height_m}, 0.04F, 0.04F, 8, steel);
    mesh.cylinder({x, 0, height_m}, {x, -0.25F, height_m + 0.3F}, 0.03F, 0.03F, 6, steel);
  }
  // The wires of the mesh, 10 cm apart: wide enough to be seen, flat enough to be cheap.
  const float half = 0.006F;
  for (float z = 0.1F; z < height_m; z += 0.1F) {
    mesh.box({0, -half, z}, {length_m, half, z + 2.0F * half}, steel,
             kSideFront | kSideBack | kSideTop);
  }
  for (float x = 0.1F; x < length_m; x += 0.1F) {
    mesh.box({x - half, -half, 0.05F}, {x + half, half, height_m}, steel, kSideFront | kSideBack);
  }
  for (int strand = 0; strand < 3; ++strand) {
    const float share = 0.3F + 0.3F * static_cast<float>(strand);
    const float y = -0.25F * share;
    const float z = height_m + 0.3F * share;
    mesh.box({0, y - half, z - half}, {length_m, y + half, z + half}, steel,
             kSideFront | kSideBack | kSideTop);
  }
}

}  // namespace km
