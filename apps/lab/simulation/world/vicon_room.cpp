#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "apps/lab/simulation/world/objects.hpp"
#include "apps/lab/simulation/world/scene.hpp"
#include "apps/lab/simulation/world/seeded_random.hpp"
#include "apps/lab/simulation/world/world.hpp"

namespace km {
namespace {

using Eigen::Isometry3f;
using Eigen::Vector2f;
using Eigen::Vector3f;
using enum Recipe;

/// Adds a flat plate, centred at the origin, with side faces.
void add_flat(Scene& scene, const Vector2f& size, float z, MaterialId material) {
  constexpr float kThickness_m = 0.002F;
  const Vector2f half = 0.5F * size;
  scene.box({-half.x(), -half.y(), z - kThickness_m}, {half.x(), half.y(), z}, material,
            kSidesNoBottom);
}

void add_play_mats(Scene& scene, float width, float depth, SeededRandom& random) {
  constexpr float kEdge_m = 0.035F;
  const std::array<MaterialId, 3> prints = {
      scene.paint(SurfaceClass::kFloor, kPlayMat, {1.0F, 1.0F, 1.0F}, 0.75F),
      scene.paint(SurfaceClass::kFloor, kPlayMat, {1.5F, 1.45F, 1.5F}, 0.95F),
      scene.paint(SurfaceClass::kFloor, kPlayMat, {0.8F, 0.75F, 0.8F}, 0.65F)};
  const auto edge = scene.plain(SurfaceClass::kFloor, {0.12F, 0.12F, 0.12F});
  // Away from each other: most in the right half and the middle.
  constexpr std::array<std::array<float, 2>, 7> kPlaces = {{{0.78F, 0.72F},
                                                            {0.84F, 0.47F},
                                                            {0.72F, 0.2F},
                                                            {0.48F, 0.25F},
                                                            {0.3F, 0.85F},
                                                            {0.62F, 0.42F},
                                                            {0.2F, 0.4F}}};
  for (std::size_t i = 0; i < kPlaces.size(); ++i) {
    const float x = kPlaces[i][0] * width + random.uniform(-0.25F, 0.25F);
    const float y = kPlaces[i][1] * depth + random.uniform(-0.25F, 0.25F);
    const auto scope =
        scene.at({x, y, 0.0004F * static_cast<float>(i)}, random.uniform(0.0F, 2.0F * kPi));
    const float length = random.uniform(1.3F, 1.9F);
    const Vector2f size(length, 0.66F * length);
    const float u = random.uniform(0.0F, 2.0F);
    scene.set_uv_offset({u, random.uniform(0.0F, 2.0F)});
    add_flat(scene, size, 0.004F, edge);
    add_flat(scene, size - Vector2f::Constant(2.0F * kEdge_m), 0.006F, prints[i % prints.size()]);
  }
  scene.set_uv_offset(Vector2f::Zero());
}

void add_tapes(Scene& scene, float width, float depth, SeededRandom& random) {
  constexpr int kTapes = 18;
  constexpr float kStrip_m = 0.125F;  // one of the sixteen of the recipe's tile
  const auto marks = scene.paint(SurfaceClass::kFloor, kMarkerTape);
  const auto grey = scene.plain(SurfaceClass::kFloor, {0.13F, 0.13F, 0.14F}, 0.03F);
  for (float i = 0; i < kTapes; ++i) {
    const float x = width * random.uniform(0.35F, 0.9F);
    const float y = depth * random.uniform(0.12F, 0.88F);
    const float z = 0.009F + 0.0007F * i;  // they cross
    const auto scope = scene.at({x, y, 0.0F}, random.uniform(0.0F, kPi));
    const float length = random.uniform(0.7F, 2.2F);
    const float strip = static_cast<float>(random.below(16)) + 0.5F;
    scene.set_uv_offset({random.uniform(0.0F, 2.0F), strip * kStrip_m});
    add_flat(scene, {length, kStrip_m}, z, marks);
    for (const float end : {-0.5F, 0.0F, 0.5F}) {
      const Vector3f at(end * length, 0.0F, 0.0F);
      scene.at(at, 0.5F * kPi + random.uniform(-0.3F, 0.3F))
          .add(add_flat, Vector2f(random.uniform(0.2F, 0.34F), 0.05F), z + 0.0004F, grey);
    }
  }
  scene.set_uv_offset(Vector2f::Zero());
}

void add_scraps(Scene& scene, float width, float depth, SeededRandom& random) {
  const auto white = scene.plain(SurfaceClass::kFloor, {0.85F, 0.85F, 0.84F});
  const auto black = scene.plain(SurfaceClass::kFloor, {0.075F, 0.075F, 0.075F});
  const auto print = scene.paint(SurfaceClass::kFloor, kNewsprint, Vector3f::Ones(), 0.9F);
  const auto scattered = [&](float from, float to) {
    const float x = width * random.uniform(from, to);
    const float y = depth * random.uniform(0.06F, 0.94F);
    return standing_at({x, y, 0.0F}, random.uniform(0.0F, kPi));
  };
  for (int i = 0; i < 230; ++i) {
    const auto scope = scene.at(scattered(0.05F, 0.8F));
    const float size = random.uniform(0.025F, 0.07F);
    add_flat(scene, {size, size * random.uniform(0.6F, 1.0F)}, 0.0035F,
             random.chance(0.85) ? white : black);
  }
  for (int i = 0; i < 26; ++i) {  // sheets of paper
    const auto scope = scene.at(scattered(0.1F, 0.9F));
    const float u = random.uniform(0.0F, 1.0F);
    scene.set_uv_offset({u, random.uniform(0.0F, 1.0F)});
    add_flat(scene, {0.21F, 0.297F}, 0.0075F, random.chance(0.6) ? print : white);
  }
  scene.set_uv_offset(Vector2f::Zero());
  for (int i = 0; i < 8; ++i) {  // crosses of black tape
    const auto scope = scene.at(scattered(0.2F, 0.6F));
    add_flat(scene, {0.22F, 0.05F}, 0.0045F, black);
    add_flat(scene, {0.05F, 0.22F}, 0.0055F, black);
  }
}

void add_room_floor(Scene& scene, float width_m, float depth_m, SeededRandom& random) {
  const auto carpet = scene.paint(SurfaceClass::kFloor, kCarpet, {0.56F, 0.57F, 0.59F});
  scene.quad({0, 0, 0}, {width_m, 0, 0}, {width_m, depth_m, 0}, {0, depth_m, 0}, carpet);
  add_play_mats(scene, width_m, depth_m, random);
  add_tapes(scene, width_m, depth_m, random);
  add_scraps(scene, width_m, depth_m, random);
}

// Walls of a room and the objects on them. A wall lies in the plane y = 0 of the builder's current
// frame, x along it from -length / 2 to length / 2, and is seen from -y.

struct WallWindow {
  float center_m = 0.0F;  ///< x
  float width_m = 1.4F;
  float sill_m = 0.85F;
  float top_m = 2.9F;
};

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
  scene.sheet(kRows, columns, point, cloth);
}

void add_window(Scene& scene, const WallWindow& window, SeededRandom& random) {
  const auto scope = scene.at({window.center_m, 0.0F, 0.0F});
  const float half = 0.5F * window.width_m;
  const float low = window.sill_m;
  const float top = window.top_m;
  const auto outside =
      scene.paint(SurfaceClass::kWall, kPlain, Vector3f::Ones(), 1.0F, 0.0F, kOutside);
  const auto frame = scene.plain(SurfaceClass::kWall, {0.6F, 0.6F, 0.58F});
  scene.quad({-half, kBehind_m, low}, {half, kBehind_m, low}, {half, kBehind_m, top},
             {-half, kBehind_m, top}, outside);
  // The niche: four sides that face its middle.
  scene.quad({-half, 0, low}, {-half, kBehind_m, low}, {-half, kBehind_m, top}, {-half, 0, top},
             frame);
  scene.quad({half, kBehind_m, low}, {half, 0, low}, {half, 0, top}, {half, kBehind_m, top}, frame);
  scene.quad({-half, 0, low}, {half, 0, low}, {half, kBehind_m, low}, {-half, kBehind_m, low},
             frame);
  scene.quad({-half, kBehind_m, top}, {half, kBehind_m, top}, {half, 0, top}, {-half, 0, top},
             frame);
  constexpr float kBar_m = 0.05F;
  const float bar_low = kBehind_m - 0.05F;
  for (const float x : {-half + kBar_m, 0.0F, half - kBar_m})
    scene.box({x - kBar_m, bar_low, low}, {x + kBar_m, kBehind_m, top}, frame);
  for (const float z : {low + kBar_m, low + 0.68F * (top - low), top - kBar_m})
    scene.box({-half, bar_low, z - 0.6F * kBar_m}, {half, kBehind_m, z + 0.6F * kBar_m}, frame);
  const float warm = random.uniform(0.95F, 1.0F);
  const auto thin = scene.paint(SurfaceClass::kCurtain, kCurtain,
                                0.72F * Vector3f(1.0F, warm, warm * warm), 1.0F, 0.0F, kBacklit);
  const float cloth = random.uniform(0.5F, 0.58F) * window.width_m;
  for (const float left : {-half - 0.12F, half + 0.12F - cloth}) {
    scene.at({left, 0.0F, 0.0F})
        .add(add_folds, cloth, low - 0.08F, top + 0.12F, -0.07F, thin, random);
  }
  const auto rod = scene.plain(SurfaceClass::kCurtain, {0.3F, 0.3F, 0.3F}, 0.1F);
  scene.cylinder({-half - 0.25F, -0.07F, top + 0.13F}, {half + 0.25F, -0.07F, top + 0.13F}, 0.015F,
                 0.015F, 8, rod);
}

/// A duct for cables along the wall with sockets on it.
void add_cable_duct(Scene& scene, float half_length, SeededRandom& random) {
  const auto white = scene.plain(SurfaceClass::kWall, {0.72F, 0.72F, 0.7F});
  const auto dark = scene.plain(SurfaceClass::kWall, {0.12F, 0.12F, 0.12F});
  constexpr float kLow_m = 0.28F;
  constexpr float kTop_m = 0.36F;
  scene.box({-half_length, -0.02F, kLow_m}, {half_length, 0.0F, kTop_m}, white, kSidesNoBack);
  for (float x = 0.4F - half_length; x < half_length - 0.4F; x += random.uniform(1.0F, 1.8F)) {
    for (const float socket : {x, x + 0.09F}) {
      scene.box({socket - 0.04F, -0.027F, kLow_m}, {socket + 0.04F, -0.02F, kTop_m}, white,
                kSidesNoBack);
      const float z = 0.5F * (kLow_m + kTop_m);
      scene.box({socket - 0.022F, -0.029F, z - 0.022F}, {socket + 0.022F, -0.027F, z + 0.022F},
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
  for (const Vector3f& chord : chords)
    scene.cylinder(from + chord, to + chord, 0.02F, 0.02F, 8, metal);
  const float length = (to - from).norm();
  bool rising = true;
  constexpr float kStep_m = 0.25F;
  for (float at = 0.0F; at + kStep_m <= length; at += kStep_m, rising = !rising) {
    for (std::size_t i = 0; i < chords.size(); ++i) {
      const Vector3f& a = chords[rising ? i : (i + 1) % 4];
      const Vector3f& b = chords[rising ? (i + 1) % 4 : i];
      scene.cylinder(from + a + at * along, from + b + (at + kStep_m) * along, 0.009F, 0.009F, 5,
                     metal, false);
    }
  }
}

void add_camera(Scene& scene, const Vector3f& position, float yaw) {
  const Scene::Object object(scene);
  const auto black = scene.plain(SurfaceClass::kObject, {0.05F, 0.05F, 0.05F}, 0.06F);
  const auto glow =
      scene.paint(SurfaceClass::kObject, kPlain, {0.9F, 0.2F, 0.15F}, 1.0F, 0.0F, 1.0F);
  Eigen::Isometry3f frame = standing_at(position, yaw);
  frame.rotate(Eigen::AngleAxisf(0.5F, Vector3f::UnitX()));  // looks down, along -y
  const auto scope = scene.at(frame);
  scene.box({-0.06F, -0.06F, -0.06F}, {0.06F, 0.1F, 0.06F}, black);
  scene.cylinder({0, -0.06F, 0}, {0, -0.08F, 0}, 0.055F, 0.055F, 14, glow);
  scene.cylinder({0, -0.08F, 0}, {0, -0.11F, 0}, 0.03F, 0.03F, 12, black);
}

/// A wall with skirting and, if `window` is set, an opening with frame, a bright outside
/// and curtains that let light through.
void add_wall(Scene& scene, float length_m, float height_m, const WallWindow* window,
              SeededRandom& random) {
  // Window walls are freshly painted, the others have seen much use.
  const auto surface =
      window != nullptr ? scene.plain(SurfaceClass::kWall, {0.92F, 0.91F, 0.88F})
                        : scene.paint(SurfaceClass::kWall, kPlaster, {1.12F, 1.11F, 1.08F}, 1.5F);
  const auto skirting = scene.plain(SurfaceClass::kWall, {0.55F, 0.54F, 0.5F});
  const float half = 0.5F * length_m;
  const auto panel = [&](float x0, float x1, float z0, float z1) {
    scene.quad({x0, 0, z0}, {x1, 0, z0}, {x1, 0, z1}, {x0, 0, z1}, surface);
  };
  scene.box({-half, -0.018F, 0.0F}, {half, 0.0F, 0.1F}, skirting, kSideFront | kSideTop);
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

/// A printed sheet of boards that hangs from `top_m` to just above the floor.
void add_plank_sheet(Scene& scene, float width_m, float top_m) {
  const auto print = scene.paint(SurfaceClass::kWall, kWoodPlanks, {1.45F, 1.5F, 1.6F}, 0.5F);
  const auto edge = scene.plain(SurfaceClass::kWall, {0.8F, 0.8F, 0.8F});
  // The boards stand upright: in a frame turned by a quarter, x runs up.
  Eigen::Isometry3f frame = Eigen::Isometry3f::Identity();
  frame.rotate(Eigen::AngleAxisf(-0.5F * kPi, Vector3f::UnitY()));
  const auto scope = scene.at(frame);
  const float half = 0.5F * width_m;
  scene.box({0.06F, -0.03F, -half}, {top_m, -0.012F, half}, edge, kSidesAll & ~kSideFront);
  scene.box({0.06F, -0.03F, -half}, {top_m, -0.012F, half}, print, kSideFront);
}

/// Dark ribbed foam, leaning.
void add_foam_panel(Scene& scene, float width_m, float height_m) {
  const Scene::Object object(scene);
  const auto foam =
      scene.paint(SurfaceClass::kFurniture, kCorrugatedMetal, {0.13F, 0.13F, 0.135F}, 0.7F);
  Eigen::Isometry3f frame = Eigen::Isometry3f(Eigen::Translation3f(0.0F, -0.22F, 0.0F));
  frame.rotate(Eigen::AngleAxisf(-0.15F, Vector3f::UnitX()));
  const auto scope = scene.at(frame);
  const float half = 0.5F * width_m;
  scene.box({-half, -0.05F, 0.0F}, {half, 0.0F, height_m}, foam);
}

/// A print of 0.3 to 0.9 m edge, centred at height `center_m`.
void add_poster(Scene& scene, float edge_m, float center_m, SeededRandom& random) {
  const auto print = scene.paint(SurfaceClass::kWall, kPosters, Vector3f::Ones(), edge_m);
  const auto scope = scene.at({-0.5F * edge_m, 0.0F, center_m - 0.5F * edge_m});
  const float u = edge_m * static_cast<float>(random.below(4));
  scene.set_uv_offset({u, edge_m * static_cast<float>(random.below(4))});
  scene.box({0, -0.006F, 0}, {edge_m, 0, edge_m}, print, kSidesNoBack);
  scene.set_uv_offset(Vector2f::Zero());
}

/// A heavy curtain from `top_m` to the floor.
void add_curtain(Scene& scene, float width_m, float top_m, SeededRandom& random) {
  const float shade = random.uniform(0.25F, 0.5F);
  const auto cloth =
      scene.paint(SurfaceClass::kCurtain, kCurtain, {shade, 0.97F * shade, 0.93F * shade});
  scene.at({-0.5F * width_m, 0.0F, 0.0F})
      .add(add_folds, width_m, 0.04F, top_m, -0.09F, cloth, random);
}

/// Ceiling at z = height over [0, width] x [0, depth], with trusses, lamps and cameras below it;
/// returns the lamps' centres in the current frame.
std::vector<Vector3f> add_ceiling(Scene& scene, float width_m, float depth_m, float height_m,
                                  SeededRandom& random) {
  const auto plaster = scene.paint(SurfaceClass::kCeiling, kPlaster, {1.0F, 1.0F, 0.98F});
  const auto metal = scene.plain(SurfaceClass::kCeiling, {0.5F, 0.51F, 0.53F}, 0.15F);
  const auto glow =
      scene.paint(SurfaceClass::kCeiling, kPlain, {1.0F, 1.0F, 0.96F}, 1.0F, 0.0F, 4.0F);
  scene.quad({0, depth_m, height_m}, {width_m, depth_m, height_m}, {width_m, 0, height_m},
             {0, 0, height_m}, plaster);
  const float z = height_m - 0.4F;
  for (const float share : {0.25F, 0.75F}) {
    const float y = share * depth_m;
    add_truss(scene, {0.05F, y, z}, {width_m - 0.05F, y, z}, metal);
    for (float x = 0.7F; x < width_m; x += 2.2F)
      add_camera(scene, {x, y, z - 0.2F}, random.uniform(0.0F, 2.0F * kPi));
  }
  std::vector<Vector3f> lamps;
  for (const float u : {0.3F, 0.7F}) {
    for (const float v : {0.4F, 0.6F}) {
      const Vector3f center(u * width_m, v * depth_m, height_m - 0.12F);
      scene.box(center - Vector3f(0.62F, 0.08F, 0.04F), center + Vector3f(0.62F, 0.08F, 0.04F),
                glow);
      lamps.emplace_back(center - Vector3f(0.0F, 0.0F, 0.1F));
    }
  }
  return lamps;
}

// The flights of V1_01 to V2_03 fill x -3.79 to 2.30, y -2.45 to 3.47, z 0.63 to 2.92 m. Walls
// stand at least 0.8 m off; what is higher than 0.5 m keeps to the outer 0.55 m.
constexpr float kEdge_m = 8.0F;
constexpr float kRoomHeight_m = 4.0F;
const Vector3f kCorner(-4.6F, -3.5F, 0.0F);
constexpr float kHalf_m = 0.5F * kEdge_m;

/// Mattresses on both sides of a window, a radiator below it, a checkerboard.
void furnish_mattress_wall(Scene& scene, SeededRandom& random) {
  const WallWindow window{random.uniform(1.6F, 1.9F), 1.5F, 0.9F, 2.9F};
  add_wall(scene, kEdge_m, kRoomHeight_m, &window, random);
  scene.at({window.center_m, 0.0F, 0.0F}).add(add_radiator, 1.3F);
  for (float x = -2.9F; x < 0.8F; x += random.uniform(1.05F, 1.2F)) {
    scene.at({x, 0.0F, 0.0F})
        .add(add_leaning_mattress, Vector3f(1.0F, 0.17F, random.uniform(1.9F, 2.1F)),
             random.uniform(0.12F, 0.3F), random);
  }
  const auto checker = scene.paint(SurfaceClass::kObject, kChecker, Vector3f::Ones(), 0.64F);
  const auto white = scene.plain(SurfaceClass::kObject, {0.8F, 0.8F, 0.8F});
  scene.at({random.uniform(-0.8F, 0.2F), -0.53F, 0.0F})
      .add(add_board, 0.48F, 0.64F, 0.12F, checker, white);
}

/// A sheet with a print of boards, foam, a leaning mattress, a shelf.
void furnish_plank_wall(Scene& scene, SeededRandom& random) {
  add_wall(scene, kEdge_m, kRoomHeight_m, nullptr, random);
  scene.at({random.uniform(-0.3F, 0.3F), 0.0F, 0.0F}).add(add_plank_sheet, 3.3F, 2.5F);
  scene.at({2.5F, 0.0F, 0.0F}).add(add_foam_panel, 1.0F, 1.15F);
  scene.at({-2.6F, 0.0F, 0.0F})
      .add(add_leaning_mattress, Vector3f(1.5F, 0.17F, 0.9F), 0.2F, random);
  scene.at({3.4F, 0.0F, 0.0F}).add(add_shelf, 0.8F, 1.75F, random);
  for (const float x : {-2.9F, -2.2F, 2.4F}) {
    scene.at({x, 0.0F, 0.0F})
        .add(add_poster, random.chance(0.5) ? 0.6F : 0.45F, random.uniform(1.6F, 2.0F), random);
  }
  scene.at({-3.5F, -0.25F, 0.0F}).add(add_stand, 2.1F, random);
}

/// A window behind a mattress, a ladder, posters, a heavy curtain.
void furnish_window_wall(Scene& scene, SeededRandom& random) {
  const WallWindow window{random.uniform(0.9F, 1.3F), 1.7F, 0.9F, 2.95F};
  add_wall(scene, kEdge_m, kRoomHeight_m, &window, random);
  scene.at({window.center_m, 0.0F, 0.0F})
      .add(add_leaning_mattress, Vector3f(2.0F, 0.17F, 0.95F), 0.25F, random);
  scene.at({2.7F, 0.0F, 0.0F})
      .add(add_leaning_mattress, Vector3f(0.9F, 0.17F, 1.95F), 0.2F, random);
  scene.at({random.uniform(-0.8F, -0.4F), 0.0F, 0.0F}).add(add_ladder, 2.5F);
  for (const float x : {-1.7F, -2.4F}) {
    scene.at({x, 0.0F, 0.0F})
        .add(add_poster, random.chance(0.5) ? 0.6F : 0.45F, random.uniform(1.4F, 1.8F), random);
  }
  scene.at({-3.3F, 0.0F, 0.0F}).add(add_curtain, 1.2F, 2.8F, random);
}

/// Desks, chairs, cartons and a cabinet: where the operators sit.
void furnish_desk_wall(Scene& scene, SeededRandom& random) {
  add_wall(scene, kEdge_m, kRoomHeight_m, nullptr, random);
  scene.at({-2.6F, 0.0F, 0.0F}).add(add_desk, random);
  scene.at({random.uniform(0.4F, 0.7F), 0.0F, 0.0F}).add(add_table, 1.5F, 0.5F, 6, random);
  scene.at({2.4F, 0.0F, 0.0F}).add(add_shelf, 1.2F, 1.9F, random);
  for (const float x : {-1.4F, -0.8F})
    scene.at({x, -0.3F, 0.0F}, random.uniform(-0.25F, 0.25F)).add(add_chair, random);
  for (float x = 0.0F; x < 1.3F; x += 0.45F) {  // below the table
    scene.at({x, -0.25F, 0.0F}, random.uniform(-0.2F, 0.2F))
        .add(add_carton, Vector3f(0.38F, 0.3F, random.uniform(0.2F, 0.36F)), random);
  }
  for (const float x : {-3.0F, -2.0F, -0.3F, 0.9F}) {
    scene.at({x, 0.0F, 0.0F})
        .add(add_poster, random.uniform(0.4F, 0.8F), random.uniform(1.6F, 2.1F), random);
  }
  scene.at({3.6F, -0.3F, 0.0F}).add(add_bucket, random);
}

/// Free-standing objects, lower than any flight.
void furnish_middle(Scene& scene, SeededRandom& random) {
  const float x = kHalf_m + random.uniform(0.6F, 1.2F);
  const float y = kHalf_m + random.uniform(0.9F, 1.4F);
  const Isometry3f stack = standing_at({x, y, 0.0F}, random.uniform(-0.3F, 0.3F));
  const auto scope = scene.at(stack);
  add_mattress_stack(scene, 3, random);
  {
    const auto tags =
        scene.paint(SurfaceClass::kObject, kTagGrid, Vector3f::Constant(1.15F), 0.78F);
    const auto white = scene.plain(SurfaceClass::kObject, {0.8F, 0.8F, 0.8F});
    scene.at({-0.5F, -1.05F, 0.0F}).add(add_board, 0.78F, 0.78F, 0.95F, tags, white);
  }
  for (float i = 0; i < 4; ++i) {
    const float angle = random.uniform(-0.6F, 0.6F);
    const Vector3f at(1.35F + random.uniform(0.0F, 0.5F), -0.9F + 0.6F * i, 0.0F);
    const auto carton = scene.at(at, angle);
    const float width = random.uniform(0.4F, 0.7F);
    add_carton(scene, {width, 0.35F, random.uniform(0.22F, 0.4F)}, random);
  }
}

}  // namespace

World make_vicon_room(std::uint64_t seed) {
  Scene scene(seed);
  SeededRandom random(seed);
  const Isometry3f T_world_room(Eigen::Translation3f(kCorner.x(), kCorner.y(), kCorner.z()));
  World world;
  world.name = "vicon_room";
  {
    const auto room = scene.at(T_world_room);
    add_room_floor(scene, kEdge_m, kEdge_m, random);
    for (const Vector3f& lamp : add_ceiling(scene, kEdge_m, kEdge_m, kRoomHeight_m, random))
      world.lighting.lamps.push_back({T_world_room * lamp, 1.3F});
    furnish_middle(scene, random);
  }
  // East, south, west and north, if not turned; each seed turns the room by a quarter more.
  using Furnish = void (*)(Scene&, SeededRandom&);
  constexpr std::array<Furnish, 4> kWalls = {furnish_mattress_wall, furnish_plank_wall,
                                             furnish_desk_wall, furnish_window_wall};
  constexpr std::array<bool, 4> kHasWindow = {true, false, false, true};
  const auto turns = static_cast<std::size_t>((seed + 3) % 4);
  for (std::size_t i = 0; i < kWalls.size(); ++i) {
    const float yaw = -0.5F * kPi * static_cast<float>((i + turns + 1) % 4);  // east: -y to -x
    const Vector3f middle = kCorner + Vector3f(kHalf_m, kHalf_m, 0.0F);
    const Isometry3f wall = standing_at(middle, yaw) * Eigen::Translation3f(0.0F, kHalf_m, 0.0F);
    const auto scope = scene.at(wall);
    kWalls[i](scene, random);
    if (kHasWindow[i]) world.lighting.lamps.push_back({wall * Vector3f(1.4F, -1.3F, 2.3F), 1.6F});
  }
  world.lighting.ambient = 0.25F;
  world.flight_volume =
      Eigen::AlignedBox3d(Eigen::Vector3d(-3.9, -2.6, 0.8), Eigen::Vector3d(2.5, 3.6, 2.95));
  scene.move_to(world);
  return world;
}

}  // namespace km
