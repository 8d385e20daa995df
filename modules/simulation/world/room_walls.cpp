#include "modules/simulation/world/room_walls.hpp"

#include <array>
#include <cmath>

namespace km {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

constexpr float kPi = 3.14159265F;
// Irradiance that would make a white surface in the room as bright as the outside is, and as the
// day makes the thin curtains.
constexpr float kOutside = 4.0F;
constexpr float kBacklit = 0.12F;
constexpr float kBehind_m = 0.16F;  // depth of the window's niche

/// Cloth in folds from z_low to z_high, from x = 0 to `width`, its mean at y = `depth`.
void add_folds(Scene& scene, float width, float z_low, float z_high, float depth, MaterialId cloth,
               SeededRandom& random) {
  constexpr int kRows = 12;
  constexpr float kAmplitude_m = 0.035F;
  const int folds = std::max(2, static_cast<int>(width / random.uniform(0.11F, 0.16F)));
  const int columns = 8 * folds;
  const float phase = random.uniform(0.0F, 2.0F * kPi);
  const float wave = random.uniform(1.5F, 3.5F);
  const auto point = [&](int row, int column) -> Vector3f {
    const float down = static_cast<float>(row) / kRows;
    const float along = static_cast<float>(column) / static_cast<float>(columns);
    const float bend = 0.6F * std::sin(wave * along * kPi + 2.0F * down + phase);
    const float fold = std::sin(2.0F * kPi * static_cast<float>(folds) * along + bend);
    const float swell =
        0.55F + 0.45F * std::sin(phase + 5.0F * along * static_cast<float>(folds) / 6.0F);
    return {along * width + 0.008F * bend,
            depth + kAmplitude_m * swell * (0.6F + 0.4F * down) * fold,
            z_high + (z_low - z_high) * down};
  };
  scene.mesh.sheet(kRows, columns, point, cloth);
}

void add_window(Scene& scene, const WallWindow& window, SeededRandom& random) {
  const ScopedFrame scope(scene.mesh, standing_at({window.center_m, 0.0F, 0.0F}, 0.0F));
  const float half = 0.5F * window.width_m;
  const float low = window.sill_m;
  const float top = window.top_m;
  const MaterialId outside = scene.library.add(SurfaceClass::kWall, Recipe::kPlain,
                                               Vector3f::Ones(), 1.0F, 0.0F, kOutside);
  const MaterialId frame = scene.plain(SurfaceClass::kWall, 0.6F, 0.6F, 0.58F);
  scene.mesh.quad({-half, kBehind_m, low}, {half, kBehind_m, low}, {half, kBehind_m, top},
                  {-half, kBehind_m, top}, outside);
  // The niche: four sides that face its middle.
  scene.mesh.quad({-half, 0, low}, {-half, kBehind_m, low}, {-half, kBehind_m, top},
                  {-half, 0, top}, frame);
  scene.mesh.quad({half, kBehind_m, low}, {half, 0, low}, {half, 0, top}, {half, kBehind_m, top},
                  frame);
  scene.mesh.quad({-half, 0, low}, {half, 0, low}, {half, kBehind_m, low}, {-half, kBehind_m, low},
                  frame);
  scene.mesh.quad({-half, kBehind_m, top}, {half, kBehind_m, top}, {half, 0, top}, {-half, 0, top},
                  frame);
  constexpr float kBar_m = 0.05F;
  const float bar_low = kBehind_m - 0.05F;
  for (const float x : {-half + kBar_m, 0.0F, half - kBar_m}) {
    scene.mesh.box({x - kBar_m, bar_low, low}, {x + kBar_m, kBehind_m, top}, frame);
  }
  for (const float z : {low + kBar_m, low + 0.68F * (top - low), top - kBar_m}) {
    scene.mesh.box({-half, bar_low, z - 0.6F * kBar_m}, {half, kBehind_m, z + 0.6F * kBar_m},
                   frame);
  }
  const float warm = random.uniform(0.95F, 1.0F);
  const MaterialId thin =
      scene.library.add(SurfaceClass::kCurtain, Recipe::kCurtain,
                        0.72F * Vector3f(1.0F, warm, warm * warm), 1.0F, 0.0F, kBacklit);
  const float cloth = random.uniform(0.5F, 0.58F) * window.width_m;
  for (const float left : {-half - 0.12F, half + 0.12F - cloth}) {
    const ScopedFrame side(scene.mesh, standing_at({left, 0.0F, 0.0F}, 0.0F));
    add_folds(scene, cloth, low - 0.08F, top + 0.12F, -0.07F, thin, random);
  }
  const MaterialId rod = scene.plain(SurfaceClass::kCurtain, 0.3F, 0.3F, 0.3F, 0.1F);
  scene.mesh.cylinder({-half - 0.25F, -0.07F, top + 0.13F}, {half + 0.25F, -0.07F, top + 0.13F},
                      0.015F, 0.015F, 8, rod);
}

/// A duct for cables along the wall with sockets on it.
void add_cable_duct(Scene& scene, float half_length, SeededRandom& random) {
  const MaterialId white = scene.plain(SurfaceClass::kWall, 0.72F, 0.72F, 0.7F);
  const MaterialId dark = scene.plain(SurfaceClass::kWall, 0.12F, 0.12F, 0.12F);
  constexpr float kLow_m = 0.28F;
  constexpr float kTop_m = 0.36F;
  scene.mesh.box({-half_length, -0.02F, kLow_m}, {half_length, 0.0F, kTop_m}, white, kSidesNoBack);
  for (float x = 0.4F - half_length; x < half_length - 0.4F; x += random.uniform(1.0F, 1.8F)) {
    for (const float socket : {x, x + 0.09F}) {
      scene.mesh.box({socket - 0.04F, -0.027F, kLow_m}, {socket + 0.04F, -0.02F, kTop_m}, white,
                     kSidesNoBack);
      const float z = 0.5F * (kLow_m + kTop_m);
      scene.mesh.box({socket - 0.022F, -0.029F, z - 0.022F}, {socket + 0.022F, -0.027F, z + 0.022F},
                     dark, kSidesNoBack);
    }
  }
}

void add_truss(Scene& scene, const Vector3f& from, const Vector3f& to, MaterialId metal) {
  constexpr float kHalf_m = 0.11F;
  const Vector3f along = (to - from).normalized();
  const Vector3f side = Vector3f::UnitZ().cross(along) * kHalf_m;
  const Vector3f up = Vector3f::UnitZ() * kHalf_m;
  const std::array<Vector3f, 4> chords = {side + up, side - up, -side - up, -side + up};
  for (const Vector3f& chord : chords) {
    scene.mesh.cylinder(from + chord, to + chord, 0.02F, 0.02F, 8, metal);
  }
  const float length = (to - from).norm();
  bool rising = true;
  constexpr float kStep_m = 0.25F;
  for (float at = 0.0F; at + kStep_m <= length; at += kStep_m, rising = !rising) {
    for (std::size_t i = 0; i < chords.size(); ++i) {
      const Vector3f& a = chords[rising ? i : (i + 1) % 4];
      const Vector3f& b = chords[rising ? (i + 1) % 4 : i];
      scene.mesh.cylinder(from + a + at * along, from + b + (at + kStep_m) * along, 0.009F, 0.009F,
                          5, metal, false);
    }
  }
}

void add_camera(Scene& scene, const Vector3f& position, float yaw) {
  const MaterialId black = scene.plain(SurfaceClass::kObject, 0.05F, 0.05F, 0.05F, 0.06F);
  const MaterialId glow = scene.library.add(SurfaceClass::kObject, Recipe::kPlain,
                                            {0.9F, 0.2F, 0.15F}, 1.0F, 0.0F, 1.0F);
  Eigen::Isometry3f frame = standing_at(position, yaw);
  frame.rotate(Eigen::AngleAxisf(0.5F, Vector3f::UnitX()));  // looks down, along -y
  const ScopedFrame scope(scene.mesh, frame);
  scene.mesh.box({-0.06F, -0.06F, -0.06F}, {0.06F, 0.1F, 0.06F}, black);
  scene.mesh.cylinder({0, -0.06F, 0}, {0, -0.08F, 0}, 0.055F, 0.055F, 14, glow);
  scene.mesh.cylinder({0, -0.08F, 0}, {0, -0.11F, 0}, 0.03F, 0.03F, 12, black);
}

}  // namespace

void add_wall(Scene& scene, float length_m, float height_m, const WallWindow* window,
              SeededRandom& random) {
  // Window walls are freshly painted, the others have seen much use.
  const MaterialId surface =
      window != nullptr
          ? scene.plain(SurfaceClass::kWall, 0.92F, 0.91F, 0.88F)
          : scene.paint(SurfaceClass::kWall, Recipe::kPlaster, {1.12F, 1.11F, 1.08F}, 1.5F);
  const MaterialId skirting = scene.plain(SurfaceClass::kWall, 0.55F, 0.54F, 0.5F);
  const float half = 0.5F * length_m;
  const auto panel = [&](float x0, float x1, float z0, float z1) {
    scene.mesh.quad({x0, 0, z0}, {x1, 0, z0}, {x1, 0, z1}, {x0, 0, z1}, surface);
  };
  scene.mesh.box({-half, -0.018F, 0.0F}, {half, 0.0F, 0.1F}, skirting, kSideFront | kSideTop);
  add_cable_duct(scene, half, random);
  if (window == nullptr) {
    panel(-half, half, 0.0F, height_m);
    return;
  }
  const float left = window->center_m - 0.5F * window->width_m;
  const float right = window->center_m + 0.5F * window->width_m;
  panel(-half, left, 0.0F, height_m);
  panel(right, half, 0.0F, height_m);
  panel(left, right, 0.0F, window->sill_m);
  panel(left, right, window->top_m, height_m);
  add_window(scene, *window, random);
}

void add_plank_sheet(Scene& scene, float width_m, float top_m) {
  const MaterialId print =
      scene.paint(SurfaceClass::kWall, Recipe::kWoodPlanks, {1.45F, 1.5F, 1.6F}, 0.5F);
  const MaterialId edge = scene.plain(SurfaceClass::kWall, 0.8F, 0.8F, 0.8F);
  // The boards stand upright: in a frame turned by a quarter, x runs up.
  Eigen::Isometry3f frame = Eigen::Isometry3f::Identity();
  frame.rotate(Eigen::AngleAxisf(-0.5F * kPi, Vector3f::UnitY()));
  const ScopedFrame scope(scene.mesh, frame);
  const float half = 0.5F * width_m;
  scene.mesh.box({0.06F, -0.03F, -half}, {top_m, -0.012F, half}, edge, kSidesAll & ~kSideFront);
  scene.mesh.box({0.06F, -0.03F, -half}, {top_m, -0.012F, half}, print, kSideFront);
}

void add_foam_panel(Scene& scene, float width_m, float height_m) {
  const MaterialId foam =
      scene.paint(SurfaceClass::kFurniture, Recipe::kCorrugatedMetal, {0.13F, 0.13F, 0.135F}, 0.7F);
  Eigen::Isometry3f frame = Eigen::Isometry3f(Eigen::Translation3f(0.0F, -0.22F, 0.0F));
  frame.rotate(Eigen::AngleAxisf(-0.15F, Vector3f::UnitX()));
  const ScopedFrame scope(scene.mesh, frame);
  const float half = 0.5F * width_m;
  scene.mesh.box({-half, -0.05F, 0.0F}, {half, 0.0F, height_m}, foam);
}

void add_poster(Scene& scene, float edge_m, float center_m, SeededRandom& random) {
  const MaterialId print =
      scene.paint(SurfaceClass::kWall, Recipe::kPosters, Vector3f::Ones(), edge_m);
  const ScopedFrame scope(scene.mesh,
                          standing_at({-0.5F * edge_m, 0.0F, center_m - 0.5F * edge_m}, 0.0F));
  const float u = edge_m * static_cast<float>(random.below(4));
  scene.mesh.set_uv_offset({u, edge_m * static_cast<float>(random.below(4))});
  scene.mesh.box({0, -0.006F, 0}, {edge_m, 0, edge_m}, print, kSidesNoBack);
  scene.mesh.set_uv_offset(Vector2f::Zero());
}

void add_curtain(Scene& scene, float width_m, float top_m, SeededRandom& random) {
  const float shade = random.uniform(0.25F, 0.5F);
  const MaterialId cloth =
      scene.paint(SurfaceClass::kCurtain, Recipe::kCurtain, {shade, 0.97F * shade, 0.93F * shade});
  const ScopedFrame scope(scene.mesh, standing_at({-0.5F * width_m, 0.0F, 0.0F}, 0.0F));
  add_folds(scene, width_m, 0.04F, top_m, -0.09F, cloth, random);
}

std::vector<Vector3f> add_ceiling(Scene& scene, float width_m, float depth_m, float height_m,
                                  SeededRandom& random) {
  const MaterialId plaster =
      scene.paint(SurfaceClass::kCeiling, Recipe::kPlaster, {1.0F, 1.0F, 0.98F});
  const MaterialId metal = scene.plain(SurfaceClass::kCeiling, 0.5F, 0.51F, 0.53F, 0.15F);
  const MaterialId glow = scene.library.add(SurfaceClass::kCeiling, Recipe::kPlain,
                                            {1.0F, 1.0F, 0.96F}, 1.0F, 0.0F, 4.0F);
  scene.mesh.quad({0, depth_m, height_m}, {width_m, depth_m, height_m}, {width_m, 0, height_m},
                  {0, 0, height_m}, plaster);
  const float z = height_m - 0.4F;
  for (const float share : {0.25F, 0.75F}) {
    const float y = share * depth_m;
    add_truss(scene, {0.05F, y, z}, {width_m - 0.05F, y, z}, metal);
    for (float x = 0.7F; x < width_m; x += 2.2F) {
      add_camera(scene, {x, y, z - 0.2F}, random.uniform(0.0F, 2.0F * kPi));
    }
  }
  std::vector<Vector3f> lamps;
  for (const float u : {0.3F, 0.7F}) {
    for (const float v : {0.4F, 0.6F}) {
      const Vector3f center(u * width_m, v * depth_m, height_m - 0.12F);
      scene.mesh.box(center - Vector3f(0.62F, 0.08F, 0.04F), center + Vector3f(0.62F, 0.08F, 0.04F),
                     glow);
      lamps.emplace_back(center - Vector3f(0.0F, 0.0F, 0.1F));
    }
  }
  return lamps;
}

}  // namespace km
