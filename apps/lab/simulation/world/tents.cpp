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

constexpr SurfaceClass kTentLabel = SurfaceClass::kTent;

struct TentPaints {
  MaterialId cloth = 0;
  MaterialId inside = 0;
  MaterialId rope = 0;
  MaterialId pole = 0;
};

TentPaints tent_paints(Scene& scene, const Vector3f& cloth) {
  return {scene.paint(kTentLabel, kCanvas, cloth), scene.plain(kTentLabel, {0.03F, 0.03F, 0.028F}),
          scene.plain(kTentLabel, {0.55F, 0.52F, 0.45F}),
          scene.paint(kTentLabel, kWoodPlanks, {0.7F, 0.6F, 0.45F})};
}

/// A rope from the cloth to a peg in the ground.
void add_guy(Scene& scene, const Vector3f& from, const Vector3f& peg, const TentPaints& paints) {
  scene.cylinder(from, peg, 0.012F, 0.012F, 5, paints.rope, false);
  scene.box(peg + Vector3f(-0.025F, -0.025F, -0.15F), peg + Vector3f(0.025F, 0.025F, 0.12F),
            paints.pole);
}

/// Canvas stretched over equal profiles (across, height) at y from 0 to length; it sags between the
/// ribs. Profile from right (+x) to left, seen from the door.
void add_vault(Scene& scene, const std::vector<Vector2f>& profile, float y0, float length, int ribs,
               float sag, MaterialId cloth) {
  const int rows = 4 * ribs;
  const int columns = static_cast<int>(profile.size()) - 1;
  const auto point = [&](float row, int column) {
    const float share = row / static_cast<float>(rows);
    const float between = std::abs(std::sin(kPi * share * static_cast<float>(ribs)));
    const Vector2f& p = profile[static_cast<std::size_t>(columns - column)];
    const float keep = p.y() > 0.3F ? 1.0F - sag * between : 1.0F;
    return Vector3f(keep * p.x(), y0 + share * length, keep * p.y());
  };
  scene.sheet(rows, columns, point, cloth);
}

/// The flat end below a profile, at y, facing out of the tent.
void add_gable(Scene& scene, const std::vector<Vector2f>& profile, float y, bool door_side,
               MaterialId material) {
  for (std::size_t i = 0; i + 1 < profile.size(); ++i) {
    const Vector3f a(profile[i].x(), y, profile[i].y());
    const Vector3f b(profile[i + 1].x(), y, profile[i + 1].y());
    const Vector3f middle(0.0F, y, profile.front().y());
    if (door_side)
      scene.triangle(middle, a, b, material);
    else
      scene.triangle(middle, b, a, material);
  }
}

/// A dark door with tied-back flaps in the gable at y.
void add_door(Scene& scene, float y, float width, float height, const TentPaints& paints) {
  const float half = 0.5F * width;
  scene.quad({-half, y - 0.012F, -0.3F}, {half, y - 0.012F, -0.3F},
             {0.7F * half, y - 0.012F, height}, {-0.7F * half, y - 0.012F, height}, paints.inside);
  for (const float side : {-1.0F, 1.0F}) {  // flaps, rolled
    scene.cylinder({side * half, y - 0.08F, -0.2F}, {side * 0.72F * half, y - 0.06F, height}, 0.09F,
                   0.06F, 8, paints.cloth);
  }
}

/// A window of netting with a rolled-up cover, in the wall x = +-half.
void add_wall_window(Scene& scene, float x, float y, float z, const TentPaints& paints) {
  const float out = x > 0.0F ? 1.0F : -1.0F;
  const float in = x - out * 0.05F;
  const float front = x + out * 0.035F;
  scene.box({std::min(in, front), y - 0.45F, z}, {std::max(in, front), y + 0.45F, z + 0.6F},
            paints.inside);
  scene.cylinder({front, y - 0.55F, z + 0.66F}, {front, y + 0.55F, z + 0.66F}, 0.07F, 0.07F, 8,
                 paints.cloth);
}

}  // namespace

void add_ridge_tent(Scene& scene, const Vector3f& cloth, SeededRandom& random) {
  const Scene::Object object(scene);
  const TentPaints paints = tent_paints(scene, cloth);
  const float ridge = random.uniform(1.95F, 2.1F);
  const std::vector<Vector2f> profile = {{1.6F, -0.4F},
                                         {1.5F, 0.15F},
                                         {0.75F, 0.52F * ridge + 0.02F},
                                         {0.0F, ridge},
                                         {-0.75F, 0.52F * ridge + 0.02F},
                                         {-1.5F, 0.15F},
                                         {-1.6F, -0.4F}};
  add_vault(scene, profile, 0.0F, 4.0F, 2, 0.035F, paints.cloth);
  add_gable(scene, profile, 0.02F, true, paints.cloth);
  add_gable(scene, profile, 3.98F, false, paints.cloth);
  add_door(scene, 0.02F, 0.9F, 1.5F, paints);
  scene.cylinder({0, -0.06F, -0.2F}, {0, -0.06F, ridge + 0.15F}, 0.035F, 0.03F, 8, paints.pole);
  add_guy(scene, {0, -0.06F, ridge + 0.1F}, {0, -1.7F, 0.0F}, paints);
  add_guy(scene, {0, 4.0F, ridge}, {0, 5.6F, 0.0F}, paints);
  for (const float y : {0.3F, 2.0F, 3.7F}) {
    add_guy(scene, {1.45F, y, 0.22F}, {2.1F, y, -0.02F}, paints);
    add_guy(scene, {-1.45F, y, 0.22F}, {-2.1F, y, -0.02F}, paints);
  }
}

void add_house_tent(Scene& scene, float length_m, const Vector3f& cloth, SeededRandom& random) {
  const Scene::Object object(scene);
  const TentPaints paints = tent_paints(scene, cloth);
  const float eave = 1.75F;
  const float ridge = random.uniform(2.9F, 3.1F);
  const std::vector<Vector2f> roof = {{2.7F, eave - 0.08F},
                                      {1.25F, 0.48F * (eave + ridge)},
                                      {0.0F, ridge},
                                      {-1.25F, 0.48F * (eave + ridge)},
                                      {-2.7F, eave - 0.08F}};
  const std::vector<Vector2f> walls = {
      {2.5F, -0.5F}, {2.5F, eave}, {0.0F, ridge - 0.05F}, {-2.5F, eave}, {-2.5F, -0.5F}};
  const int bays = std::max(2, static_cast<int>(length_m / 2.0F));
  add_vault(scene, roof, -0.25F, length_m + 0.5F, bays, 0.012F, paints.cloth);
  for (const float side : {1.0F, -1.0F}) {
    const std::vector<Vector2f> wall = {{side * 2.5F, side > 0.0F ? -0.5F : eave},
                                        {side * 2.5F, side > 0.0F ? eave : -0.5F}};
    add_vault(scene, wall, 0.0F, length_m, bays, 0.01F, paints.cloth);
    for (int bay = 0; bay < bays; ++bay) {
      const float y = length_m * (static_cast<float>(bay) + 0.5F) / static_cast<float>(bays);
      if (bay % 2 == 0) add_wall_window(scene, side * 2.5F, y, 0.7F, paints);
    }
    for (int rib = 0; rib <= bays; ++rib) {
      const float y = length_m * static_cast<float>(rib) / static_cast<float>(bays);
      add_guy(scene, {side * 2.65F, y, eave}, {side * 3.9F, y, -0.05F}, paints);
    }
  }
  add_gable(scene, walls, 0.0F, true, paints.cloth);
  add_gable(scene, walls, length_m, false, paints.cloth);
  add_door(scene, 0.0F, 1.6F, 2.0F, paints);
}

void add_tunnel_shelter(Scene& scene, float length_m, const Vector3f& cloth) {
  const Scene::Object object(scene);
  const TentPaints paints = tent_paints(scene, cloth);
  std::vector<Vector2f> profile = {{3.0F, -0.5F}};
  constexpr int kPieces = 14;
  for (float i = 0; i <= kPieces; ++i) {
    const float angle = kPi * i / kPieces;
    profile.emplace_back(3.0F * std::cos(angle), 3.1F * std::sin(angle));
  }
  profile.emplace_back(-3.0F, -0.5F);
  const int ribs = std::max(2, static_cast<int>(length_m / 1.8F));
  add_vault(scene, profile, 0.0F, length_m, ribs, 0.025F, paints.cloth);
  add_gable(scene, profile, 0.03F, true, paints.cloth);
  add_gable(scene, profile, length_m - 0.03F, false, paints.cloth);
  add_door(scene, 0.03F, 2.2F, 2.3F, paints);
  const auto dark = scene.plain(kTentLabel, {0.07F, 0.07F, 0.06F});
  for (int rib = 0; rib <= ribs; ++rib) {
    const float y = length_m * static_cast<float>(rib) / static_cast<float>(ribs);
    for (int i = 0; i < kPieces; ++i) {
      const Vector2f& a = profile[static_cast<std::size_t>(i + 1)];
      const Vector2f& b = profile[static_cast<std::size_t>(i + 2)];
      scene.cylinder({1.005F * a.x(), y, 1.005F * a.y()}, {1.005F * b.x(), y, 1.005F * b.y()},
                     0.045F, 0.045F, 6, dark, false);
    }
  }
}

void add_dome_tent(Scene& scene, float radius_m, const Vector3f& cloth) {
  const Scene::Object object(scene);
  const TentPaints paints = tent_paints(scene, cloth);
  const auto second = scene.paint(kTentLabel, kCanvas, 0.72F * cloth);
  constexpr int kPanels = 10;
  for (int panel = 0; panel < kPanels; ++panel) {
    const auto point = [&](float row, float column) {
      const float up = std::min(0.5F * kPi, 0.5F * kPi * row / 7.0F);
      const float angle = 2.0F * kPi * (static_cast<float>(panel) + column / 4.0F) / kPanels;
      const float mid = std::abs(column - 2.0F) / 2.0F;
      const float bulge = 0.97F + 0.03F * mid;  // flat panels between the arcs
      const float r = bulge * radius_m * std::cos(up);
      const float z = row == 0 ? -0.4F : 0.78F * bulge * radius_m * std::sin(up);
      return Vector3f(r * std::cos(angle), r * std::sin(angle), z);
    };
    scene.sheet(7, 4, point, panel % 2 == 0 ? paints.cloth : second);
  }
  const auto porch = scene.at({0.0F, -1.05F * radius_m, 0.0F});
  const std::vector<Vector2f> arch = {
      {0.9F, -0.4F}, {0.85F, 1.2F}, {0.0F, 1.75F}, {-0.85F, 1.2F}, {-0.9F, -0.4F}};
  add_vault(scene, arch, -0.2F, 0.6F * radius_m, 1, 0.0F, paints.cloth);
  add_gable(scene, arch, 0.0F, true, paints.inside);
}

void add_awning_roof(Scene& scene, const Vector3f& cloth) {
  const Scene::Object object(scene);
  const TentPaints paints = tent_paints(scene, cloth);
  const auto height = [](float u, float v) {
    return 2.55F - 0.35F * (1.0F - std::abs(2.0F * u - 1.0F)) * (1.0F - std::abs(2.0F * v - 1.0F));
  };
  const auto sail = [&](bool upper) {
    const auto point = [&](float row, int column) {
      const float u = static_cast<float>(upper ? column : 10 - column) / 10.0F;
      const float v = row / 8.0F;
      return Vector3f(5.0F * u - 2.5F, 4.0F * v - 2.0F, height(u, v) - (upper ? 0.0F : 0.01F));
    };
    scene.sheet(8, 10, point, paints.cloth);
  };
  sail(true);
  sail(false);
  for (const float x : {-2.5F, 2.5F}) {
    for (const float y : {-2.0F, 2.0F}) {
      scene.cylinder({x, y, -0.3F}, {x, y, 2.6F}, 0.035F, 0.03F, 8, paints.pole);
      add_guy(scene, {x, y, 2.5F}, {1.5F * x, 1.5F * y, -0.05F}, paints);
    }
  }
}

}  // namespace km
