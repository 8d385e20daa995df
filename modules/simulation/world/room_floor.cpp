#include "modules/simulation/world/room_floor.hpp"

#include <array>
#include <cmath>

namespace km {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

constexpr float kPi = 3.14159265F;

/// Something flat, centred, its sides closed.
void add_flat(Scene& scene, const Vector2f& size, float z, MaterialId material) {
  constexpr float kThickness_m = 0.002F;
  const Vector2f half = 0.5F * size;
  scene.mesh.box({-half.x(), -half.y(), z - kThickness_m}, {half.x(), half.y(), z}, material,
                 kSidesNoBottom);
}

void add_play_mats(Scene& scene, float width, float depth, SeededRandom& random) {
  constexpr float kEdge_m = 0.035F;
  const std::array<MaterialId, 3> prints = {
      scene.paint(SurfaceClass::kFloor, Recipe::kPlayMat, {1.0F, 1.0F, 1.0F}, 0.75F),
      scene.paint(SurfaceClass::kFloor, Recipe::kPlayMat, {1.5F, 1.45F, 1.5F}, 0.95F),
      scene.paint(SurfaceClass::kFloor, Recipe::kPlayMat, {0.8F, 0.75F, 0.8F}, 0.65F)};
  const MaterialId edge = scene.plain(SurfaceClass::kFloor, 0.12F, 0.12F, 0.12F);
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
    const ScopedFrame scope(scene.mesh, standing_at({x, y, 0.0004F * static_cast<float>(i)},
                                                    random.uniform(0.0F, 2.0F * kPi)));
    const float length = random.uniform(1.3F, 1.9F);
    const Vector2f size(length, 0.66F * length);
    const float u = random.uniform(0.0F, 2.0F);
    scene.mesh.set_uv_offset({u, random.uniform(0.0F, 2.0F)});
    add_flat(scene, size, 0.004F, edge);
    add_flat(scene, size - Vector2f::Constant(2.0F * kEdge_m), 0.006F, prints[i % prints.size()]);
  }
  scene.mesh.set_uv_offset(Vector2f::Zero());
}

void add_tapes(Scene& scene, float width, float depth, SeededRandom& random) {
  constexpr int kTapes = 18;
  constexpr float kStrip_m = 0.125F;  // one of the sixteen of the recipe's tile
  const MaterialId marks = scene.paint(SurfaceClass::kFloor, Recipe::kMarkerTape);
  const MaterialId grey = scene.plain(SurfaceClass::kFloor, 0.13F, 0.13F, 0.14F, 0.03F);
  for (int i = 0; i < kTapes; ++i) {
    const float x = width * random.uniform(0.35F, 0.9F);
    const float y = depth * random.uniform(0.12F, 0.88F);
    const float z = 0.009F + 0.0007F * static_cast<float>(i);  // they cross
    const ScopedFrame scope(scene.mesh, standing_at({x, y, 0.0F}, random.uniform(0.0F, kPi)));
    const float length = random.uniform(0.7F, 2.2F);
    const float strip = static_cast<float>(random.below(16)) + 0.5F;
    scene.mesh.set_uv_offset({random.uniform(0.0F, 2.0F), strip * kStrip_m});
    add_flat(scene, {length, kStrip_m}, z, marks);
    for (const float end : {-0.5F, 0.0F, 0.5F}) {
      const Vector3f at(end * length, 0.0F, 0.0F);
      const ScopedFrame held(scene.mesh, standing_at(at, 0.5F * kPi + random.uniform(-0.3F, 0.3F)));
      add_flat(scene, {random.uniform(0.2F, 0.34F), 0.05F}, z + 0.0004F, grey);
    }
  }
  scene.mesh.set_uv_offset(Vector2f::Zero());
}

void add_scraps(Scene& scene, float width, float depth, SeededRandom& random) {
  const MaterialId white = scene.plain(SurfaceClass::kFloor, 0.85F, 0.85F, 0.84F);
  const MaterialId black = scene.plain(SurfaceClass::kFloor, 0.075F, 0.075F, 0.075F);
  const MaterialId print =
      scene.paint(SurfaceClass::kFloor, Recipe::kNewsprint, Vector3f::Ones(), 0.9F);
  const auto scattered = [&](float from, float to) {
    const float x = width * random.uniform(from, to);
    const float y = depth * random.uniform(0.06F, 0.94F);
    return standing_at({x, y, 0.0F}, random.uniform(0.0F, kPi));
  };
  for (int i = 0; i < 230; ++i) {
    const ScopedFrame scope(scene.mesh, scattered(0.05F, 0.8F));
    const float size = random.uniform(0.025F, 0.07F);
    add_flat(scene, {size, size * random.uniform(0.6F, 1.0F)}, 0.0035F,
             random.chance(0.85) ? white : black);
  }
  for (int i = 0; i < 26; ++i) {  // sheets of paper
    const ScopedFrame scope(scene.mesh, scattered(0.1F, 0.9F));
    const float u = random.uniform(0.0F, 1.0F);
    scene.mesh.set_uv_offset({u, random.uniform(0.0F, 1.0F)});
    add_flat(scene, {0.21F, 0.297F}, 0.0075F, random.chance(0.6) ? print : white);
  }
  scene.mesh.set_uv_offset(Vector2f::Zero());
  for (int i = 0; i < 8; ++i) {  // crosses of black tape
    const ScopedFrame scope(scene.mesh, scattered(0.2F, 0.6F));
    add_flat(scene, {0.22F, 0.05F}, 0.0045F, black);
    add_flat(scene, {0.05F, 0.22F}, 0.0055F, black);
  }
}

}  // namespace

void add_room_floor(Scene& scene, float width_m, float depth_m, SeededRandom& random) {
  const MaterialId carpet =
      scene.paint(SurfaceClass::kFloor, Recipe::kCarpet, {0.56F, 0.57F, 0.59F});
  scene.mesh.quad({0, 0, 0}, {width_m, 0, 0}, {width_m, depth_m, 0}, {0, depth_m, 0}, carpet);
  add_play_mats(scene, width_m, depth_m, random);
  add_tapes(scene, width_m, depth_m, random);
  add_scraps(scene, width_m, depth_m, random);
}

}  // namespace km
