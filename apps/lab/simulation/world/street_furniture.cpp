#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "apps/lab/simulation/world/objects.hpp"

namespace km {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;
using enum Recipe;

MaterialId iron(Scene& scene, SurfaceClass label) {
  return scene.plain(label, {0.06F, 0.065F, 0.07F}, 0.05F);
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
  const auto frame = scene.at(upright);  // frame whose z axis points to -y
  scene.extrude(regular(corners, radius, turn), 0.0F, 0.02F, rim);
  scene.polygon(regular(corners, 0.78F * radius, turn), 0.024F, field);
}

void add_bars(Scene& scene, float x0, float x1, float pitch, float half, float z0, float z1,
              MaterialId material) {
  const int count = std::max(1, static_cast<int>((x1 - x0) / pitch));
  for (int i = 0; i < count; ++i) {
    const float x = x0 + (x1 - x0) * (static_cast<float>(i) + 0.5F) / static_cast<float>(count);
    scene.box({x - half, -half, z0}, {x + half, half, z1}, material, kSidesNoBottom);
  }
}

}  // namespace

void add_street_lamp(Scene& scene, SeededRandom& random) {
  const Scene::Object object(scene);
  const auto post = iron(scene, SurfaceClass::kPole);
  const auto lens = scene.plain(SurfaceClass::kPole, {0.85F, 0.84F, 0.78F}, 0.1F);
  const float height = 5.5F;
  const Vector2f foot[] = {{0.14F, -0.1F}, {0.14F, 0.35F}, {0.1F, 0.42F},
                           {0.085F, 0.9F}, {0.065F, 1.0F}, {0.05F, height}};
  scene.revolve(foot, 12, post);
  if (random.chance(0.5)) {
    scene.cylinder({0, 0, height - 0.1F}, {0, -0.7F, height + 0.25F}, 0.04F, 0.035F, 8, post);
    scene.cylinder({0, -0.7F, height + 0.25F}, {0, -1.3F, height + 0.28F}, 0.035F, 0.035F, 8, post);
    scene.ellipsoid({0, -1.5F, height + 0.27F}, {0.14F, 0.36F, 0.09F}, 12, post);
    scene.ellipsoid({0, -1.52F, height + 0.22F}, {0.1F, 0.27F, 0.07F}, 12, lens);
  } else {
    const Vector2f lantern[] = {{0.05F, height},
                                {0.1F, height + 0.05F},
                                {0.2F, height + 0.55F},
                                {0.26F, height + 0.57F},
                                {0.0F, height + 0.85F}};
    scene.revolve(std::span(lantern).first(3), 8, lens);
    scene.revolve(std::span(lantern).last(3), 8, post);
  }
}

void add_traffic_sign(Scene& scene, SeededRandom& random) {
  const Scene::Object object(scene);
  constexpr SurfaceClass kLabel = SurfaceClass::kPole;
  const auto pole = scene.plain(kLabel, {0.4F, 0.41F, 0.42F}, 0.1F);
  const auto red = scene.plain(kLabel, {0.55F, 0.03F, 0.03F});
  const auto white = scene.plain(kLabel, {0.82F, 0.82F, 0.8F});
  const auto blue = scene.plain(kLabel, {0.03F, 0.13F, 0.5F});
  const auto black = scene.plain(kLabel, {0.03F, 0.03F, 0.03F});
  const float z = random.uniform(2.3F, 2.6F);
  scene.cylinder({0, 0, -0.1F}, {0, 0, z + 0.4F}, 0.035F, 0.035F, 8, pole);
  switch (random.below(5)) {
    case 0:
      add_plate(scene, 20, 0.33F, 0.0F, z, red, white);
      scene.box({-0.16F, -0.075F, z - 0.09F}, {-0.04F, -0.064F, z + 0.1F}, black);
      scene.box({0.03F, -0.075F, z - 0.09F}, {0.16F, -0.064F, z + 0.1F}, black);
      break;
    case 1:
      add_plate(scene, 3, 0.45F, 0.5F * kPi, z, red, white);
      scene.box({-0.03F, -0.075F, z - 0.08F}, {0.03F, -0.064F, z + 0.16F}, black);
      break;
    case 2:
      add_plate(scene, 20, 0.33F, 0.0F, z, white, blue);
      scene.box({-0.04F, -0.075F, z - 0.17F}, {0.04F, -0.064F, z + 0.17F}, white);
      break;
    case 3:
      add_plate(scene, 8, 0.38F, 0.125F * kPi, z, white, red);
      scene.box({-0.24F, -0.075F, z - 0.07F}, {0.24F, -0.064F, z + 0.07F}, white);
      break;
    default: {
      scene.at({-0.5F, -0.04F, 0.0F}).add(add_sign_board, 0.0F, z, 1.0F, 0.22F, kLabel, random);
    }
  }
  if (random.chance(0.3)) {
    scene.box({-0.26F, -0.06F, z - 0.68F}, {0.26F, -0.04F, z - 0.48F}, white);
    scene.box({-0.2F, -0.064F, z - 0.61F}, {0.16F, -0.06F, z - 0.56F}, black);
  }
}

void add_traffic_light(Scene& scene) {
  const Scene::Object object(scene);
  constexpr SurfaceClass kLabel = SurfaceClass::kPole;
  const auto post = iron(scene, kLabel);
  scene.cylinder({0, 0, -0.1F}, {0, 0, 3.3F}, 0.06F, 0.055F, 10, post);
  scene.box({-0.15F, -0.2F, 2.35F}, {0.15F, 0.02F, 3.25F}, post);
  const std::array<MaterialId, 3> lamps = {scene.plain(kLabel, {0.06F, 0.3F, 0.1F}, 0.15F),
                                           scene.plain(kLabel, {0.35F, 0.2F, 0.03F}, 0.15F),
                                           scene.plain(kLabel, {0.7F, 0.05F, 0.04F}, 0.15F)};
  for (std::size_t i = 0; i < lamps.size(); ++i) {
    const float z = 2.5F + 0.3F * static_cast<float>(i);
    scene.cylinder({0, -0.2F, z}, {0, -0.21F, z}, 0.1F, 0.1F, 14, lamps[i]);
    scene.cylinder({0, -0.36F, z + 0.04F}, {0, -0.2F, z + 0.02F}, 0.12F, 0.12F, 14, post, false);
  }
}

void add_bench(Scene& scene) {
  const Scene::Object object(scene);
  constexpr SurfaceClass kLabel = SurfaceClass::kObject;
  const auto wood = scene.paint(kLabel, kWoodPlanks, {0.9F, 0.75F, 0.55F});
  const auto metal = iron(scene, kLabel);
  for (const float x : {-0.75F, 0.7F}) {
    scene.box({x, -0.22F, -0.05F}, {x + 0.05F, -0.17F, 0.42F}, metal);
    scene.box({x, 0.17F, -0.05F}, {x + 0.05F, 0.22F, 0.85F}, metal);
    scene.box({x, -0.22F, 0.38F}, {x + 0.05F, 0.2F, 0.42F}, metal);
  }
  for (float slat = 0; slat < 4; ++slat) {
    const float y = -0.24F + 0.11F * slat;
    scene.box({-0.9F, y, 0.42F}, {0.9F, y + 0.09F, 0.455F}, wood);
  }
  for (float slat = 0; slat < 3; ++slat) {
    const float z = 0.52F + 0.12F * slat;
    scene.box({-0.9F, 0.13F, z}, {0.9F, 0.17F, z + 0.09F}, wood);
  }
}

void add_bin(Scene& scene, SeededRandom& random) {
  const Scene::Object object(scene);
  constexpr SurfaceClass kLabel = SurfaceClass::kObject;
  if (random.chance(0.5)) {  // a wheeled bin
    const Vector3f tints[] = {{0.05F, 0.06F, 0.06F}, {0.05F, 0.16F, 0.07F}, {0.35F, 0.28F, 0.04F}};
    const auto body = scene.plain(kLabel, random.pick(tints));
    scene.box({-0.26F, -0.3F, 0.06F}, {0.26F, 0.3F, 0.95F}, body);
    scene.box({-0.29F, -0.36F, 0.95F}, {0.29F, 0.32F, 1.03F}, body);
    scene.cylinder({-0.28F, 0.26F, 0.1F}, {0.28F, 0.26F, 0.1F}, 0.1F, 0.1F, 10,
                   iron(scene, kLabel));
    return;
  }
  const auto body = scene.paint(kLabel, kPaintedMetal, {0.12F, 0.2F, 0.14F});
  const Vector2f profile[] = {{0.2F, 0.0F}, {0.24F, 0.75F}, {0.27F, 0.78F}, {0.18F, 0.9F}};
  scene.revolve(profile, 14, body);
  scene.cylinder({0, 0, 0.84F}, {0, 0, 0.86F}, 0.2F, 0.2F, 14, iron(scene, kLabel));
}

void add_bollard(Scene& scene) {
  const Scene::Object object(scene);
  const auto post = iron(scene, SurfaceClass::kPole);
  const auto band = scene.plain(SurfaceClass::kPole, {0.8F, 0.8F, 0.78F});
  scene.cylinder({0, 0, -0.1F}, {0, 0, 0.9F}, 0.06F, 0.055F, 10, post);
  scene.cylinder({0, 0, 0.72F}, {0, 0, 0.82F}, 0.062F, 0.062F, 10, band);
  scene.ellipsoid({0, 0, 0.92F}, {0.07F, 0.07F, 0.07F}, 10, post);
}

void add_hydrant(Scene& scene) {
  const Scene::Object object(scene);
  const auto red = scene.paint(SurfaceClass::kObject, kPaintedMetal, {0.6F, 0.07F, 0.05F});
  const Vector2f profile[] = {{0.16F, -0.05F}, {0.16F, 0.06F}, {0.11F, 0.08F},
                              {0.11F, 0.55F},  {0.15F, 0.58F}, {0.0F, 0.78F}};
  scene.revolve(profile, 12, red);
  scene.cylinder({-0.22F, 0, 0.42F}, {0.22F, 0, 0.42F}, 0.06F, 0.06F, 10, red);
}

void add_mail_box(Scene& scene, SeededRandom& random) {
  const Scene::Object object(scene);
  constexpr SurfaceClass kLabel = SurfaceClass::kObject;
  const auto body = random.chance(0.5) ? scene.plain(kLabel, {0.65F, 0.5F, 0.04F})
                                       : scene.plain(kLabel, {0.5F, 0.04F, 0.04F});
  const auto dark = iron(scene, kLabel);
  scene.box({-0.06F, -0.06F, -0.05F}, {0.06F, 0.06F, 0.75F}, dark);
  scene.box({-0.27F, -0.2F, 0.72F}, {0.27F, 0.2F, 1.3F}, body);
  scene.cylinder({-0.27F, 0, 1.3F}, {0.27F, 0, 1.3F}, 0.2F, 0.2F, 14, body);
  scene.box({-0.18F, -0.215F, 1.14F}, {0.18F, -0.2F, 1.19F}, dark);
  scene.box({-0.14F, -0.206F, 0.85F}, {0.14F, -0.2F, 1.02F},
            scene.plain(kLabel, {0.8F, 0.8F, 0.78F}));
}

void add_advertising_column(Scene& scene, SeededRandom& random) {
  const Scene::Object object(scene);
  constexpr SurfaceClass kLabel = SurfaceClass::kObject;
  const auto prints = scene.paint(kLabel, kPosters);
  const auto rim = scene.paint(kLabel, kPaintedMetal, {0.1F, 0.18F, 0.12F});
  scene.set_uv_offset({static_cast<float>(random.below(4)), static_cast<float>(random.below(4))});
  scene.cylinder({0, 0, 0.3F}, {0, 0, 2.9F}, 0.637F, 0.637F, 28, prints, false);
  scene.set_uv_offset(Vector2f::Zero());
  scene.cylinder({0, 0, -0.1F}, {0, 0, 0.3F}, 0.7F, 0.68F, 28, rim);
  const Vector2f cap[] = {{0.64F, 2.88F}, {0.78F, 2.95F}, {0.74F, 3.1F}, {0.0F, 3.7F}};
  scene.revolve(cap, 28, rim);
}

void add_planter(Scene& scene, SeededRandom& random) {
  const Scene::Object object(scene);
  const auto stone = scene.paint(SurfaceClass::kObject, kConcrete, {0.9F, 0.9F, 0.86F});
  const auto soil = scene.paint(SurfaceClass::kTerrain, kSoil);
  const auto leaves = scene.paint(SurfaceClass::kVegetation, kLeaves, {1.1F, 1.1F, 0.9F});
  scene.box({-0.8F, -0.35F, -0.05F}, {0.8F, 0.35F, 0.5F}, stone, kSidesAround);
  scene.box({-0.84F, -0.39F, 0.5F}, {0.84F, 0.39F, 0.56F}, stone);
  scene.quad({-0.75F, -0.3F, 0.57F}, {0.75F, -0.3F, 0.57F}, {0.75F, 0.3F, 0.57F},
             {-0.75F, 0.3F, 0.57F}, soil);
  for (const float x : {-0.5F, 0.0F, 0.5F}) {
    const float r = random.uniform(0.25F, 0.38F);
    scene.leaf_cluster({x, 0, 0.5F + 0.8F * r}, {r, 0.8F * r, r}, 90, 0.16F, leaves, random);
  }
}

void add_sign_board(Scene& scene, float x, float z, float width_m, float height_m,
                    SurfaceClass label, SeededRandom& random) {
  const Vector3f boards[] = {{0.55F, 0.08F, 0.06F}, {0.05F, 0.13F, 0.4F},  {0.04F, 0.25F, 0.12F},
                             {0.75F, 0.72F, 0.66F}, {0.08F, 0.08F, 0.09F}, {0.7F, 0.45F, 0.06F},
                             {0.3F, 0.08F, 0.25F}};
  const Vector3f paint = random.pick(boards);
  const auto board = scene.plain(label, paint);
  const float ink = paint.x() + paint.y() + paint.z() > 1.2F ? 0.05F : 0.85F;
  const auto letters = scene.plain(label, {ink, ink, 0.95F * ink});
  scene.box({x, -0.1F, z}, {x + width_m, 0.0F, z + height_m}, board, kSidesNoBack);
  const float letter = 0.6F * height_m;
  const float bottom = z + 0.2F * height_m;
  const float stroke = 0.16F * letter;
  for (float left = x + 0.4F * letter; left + letter < x + width_m; left += 0.95F * letter) {
    if (random.chance(0.14)) continue;  // a space
    const float right = left + 0.62F * letter;
    const auto bar = [&](float x0, float z0, float x1, float z1) {
      if (random.chance(0.55)) scene.box({x0, -0.125F, z0}, {x1, -0.1F, z1}, letters, kSidesNoBack);
    };
    const float top = bottom + letter;
    const float middle = bottom + 0.5F * letter;
    bar(left, bottom, left + stroke, top);
    bar(right - stroke, bottom, right, top);
    bar(left, top - stroke, right, top);
    bar(left, middle - 0.5F * stroke, right, middle + 0.5F * stroke);
    bar(left, bottom, right, bottom + stroke);
  }
}

void add_railing(Scene& scene, float length_m, float height_m) {
  const auto bar = iron(scene, SurfaceClass::kFence);
  const auto stone = scene.paint(SurfaceClass::kFence, kConcrete);
  scene.box({0, -0.12F, -0.1F}, {length_m, 0.12F, 0.3F}, stone, kSidesNoBottom);
  for (const float z : {0.42F, height_m - 0.15F})
    scene.box({0, -0.02F, z}, {length_m, 0.02F, z + 0.04F}, bar);
  add_bars(scene, 0.0F, length_m, 0.14F, 0.011F, 0.3F, height_m, bar);
  add_bars(scene, 0.0F, length_m, 2.4F, 0.04F, 0.3F, height_m + 0.1F, bar);
}

void add_plank_fence(Scene& scene, float length_m, float height_m) {
  const auto wood = scene.paint(SurfaceClass::kFence, kWoodPlanks, {0.85F, 0.8F, 0.75F});
  const int boards = std::max(1, static_cast<int>(length_m / 0.16F));
  const float pitch = length_m / static_cast<float>(boards);
  for (int i = 0; i < boards; ++i) {
    const float x = pitch * static_cast<float>(i);
    const float top = height_m - 0.02F * static_cast<float>(i * 7 % 3);
    scene.box({x + 0.008F, -0.02F, 0.06F}, {x + pitch - 0.008F, 0.0F, top}, wood, kSidesNoBottom);
  }
  for (const float z : {0.35F, height_m - 0.4F})
    scene.box({0, 0.0F, z}, {length_m, 0.05F, z + 0.09F}, wood);
  for (float x = 0.2F; x < length_m; x += 2.2F)
    scene.box({x, 0.04F, -0.2F}, {x + 0.09F, 0.13F, height_m}, wood);
}

void add_wire_fence(Scene& scene, float length_m, float height_m) {
  constexpr SurfaceClass kLabel = SurfaceClass::kFence;
  const auto steel = scene.plain(kLabel, {0.36F, 0.37F, 0.37F}, 0.1F);
  for (float x = 0.05F; x < length_m; x += 2.5F) {
    scene.cylinder({x, 0, -0.3F}, {x, 0, height_m}, 0.04F, 0.04F, 8, steel);
    scene.cylinder({x, 0, height_m}, {x, -0.25F, height_m + 0.3F}, 0.03F, 0.03F, 6, steel);
  }
  // The wires of the mesh, 10 cm apart: wide enough to be seen, flat enough to be cheap.
  const float half = 0.006F;
  for (float z = 0.1F; z < height_m; z += 0.1F) {
    scene.box({0, -half, z}, {length_m, half, z + 2.0F * half}, steel,
              kSideFront | kSideBack | kSideTop);
  }
  for (float x = 0.1F; x < length_m; x += 0.1F)
    scene.box({x - half, -half, 0.05F}, {x + half, half, height_m}, steel, kSideFront | kSideBack);
  for (float strand = 0; strand < 3; ++strand) {
    const float share = 0.3F + 0.3F * strand;
    const float y = -0.25F * share;
    const float z = height_m + 0.3F * share;
    scene.box({0, y - half, z - half}, {length_m, y + half, z + half}, steel,
              kSideFront | kSideBack | kSideTop);
  }
}

}  // namespace km
