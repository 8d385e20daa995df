#include <cmath>
#include <numbers>
#include <vector>

#include "apps/lab/simulation/world/objects.hpp"

namespace km {
namespace {

using Eigen::Isometry3f;
using Eigen::Vector2f;
using Eigen::Vector3f;
using enum Recipe;

/// A rectangle around the origin with rounded corners, counter-clockwise.
std::vector<Vector2f> rounded_rectangle(float width, float depth, float radius) {
  constexpr int kSteps = 4;
  std::vector<Vector2f> outline;
  for (int corner = 0; corner < 4; ++corner) {
    const float sx = corner == 0 || corner == 3 ? 1.0F : -1.0F;
    const float sy = corner < 2 ? 1.0F : -1.0F;
    const Vector2f center(sx * (0.5F * width - radius), sy * (0.5F * depth - radius));
    for (float i = 0; i <= kSteps; ++i) {
      const float angle = 0.5F * kPi * (static_cast<float>(corner) + i / kSteps);
      outline.emplace_back(center + radius * Vector2f(std::cos(angle), std::sin(angle)));
    }
  }
  return outline;
}

/// The piping along the edges of an upright mattress whose corners have this radius.
void add_seams(Scene& scene, const Vector3f& size_m, float radius, float shade) {
  constexpr float kPiping_m = 0.005F;
  const auto piping = scene.plain(SurfaceClass::kFurniture, {shade, shade, shade});
  const float inset = radius * (1.0F - std::numbers::sqrt2_v<float> / 2.0F);
  const float x = 0.5F * size_m.x() - inset;
  const float y = 0.5F * size_m.y() - inset;
  for (const float face : {-y, y}) {
    for (const float end : {-x, x}) {
      scene.cylinder({end, face, 0.0F}, {end, face, size_m.z()}, kPiping_m, kPiping_m, 5, piping,
                     false);
    }
    const float edge = face < 0.0F ? -0.5F * size_m.y() : 0.5F * size_m.y();
    for (const float z : {0.0F, size_m.z()})
      scene.cylinder({-x, edge, z}, {x, edge, z}, kPiping_m, kPiping_m, 5, piping, false);
  }
}

/// Upright mattress centred on the origin's vertical axis, its cover of this albedo.
void add_mattress(Scene& scene, const Vector3f& size_m, float shade, SeededRandom& random) {
  const auto cover =
      scene.paint(SurfaceClass::kFurniture, kMattress, {shade, 1.02F * shade, 1.1F * shade});
  const float u = random.uniform(0.0F, 2.0F);
  scene.set_uv_offset({u, random.uniform(0.0F, 2.0F)});
  const float radius = std::min(0.06F, 0.4F * size_m.y());
  scene.extrude(rounded_rectangle(size_m.x(), size_m.y(), radius), 0.0F, size_m.z(), cover);
  scene.set_uv_offset(Vector2f::Zero());
  add_seams(scene, size_m, radius, std::min(1.5F * shade, 0.9F));
  const auto tag = scene.plain(SurfaceClass::kFurniture, {0.85F, 0.85F, 0.83F});
  const float side = random.sign() * (0.5F * size_m.x() - radius - 0.08F);
  const Vector3f low(side - 0.045F, -0.5F * size_m.y() - 0.003F, 0.08F);
  scene.box(low, low + Vector3f(0.09F, 0.004F, 0.05F), tag);
}

Isometry3f leaning(float angle_rad) {
  return Isometry3f(Eigen::AngleAxisf(-angle_rad, Vector3f::UnitX()));
}

Vector3f paint_color(SeededRandom& random) {
  const float red = random.uniform(0.05F, 0.8F);
  const float green = random.uniform(0.05F, 0.75F);
  return {red, green, random.uniform(0.05F, 0.7F)};
}

void add_leg(Scene& scene, float x, float y, float height, MaterialId material) {
  constexpr float kHalf = 0.02F;
  scene.box({x - kHalf, y - kHalf, 0.0F}, {x + kHalf, y + kHalf, height}, material, kSidesNoBottom);
}

/// Something small that stands at the origin: a book, a box, a bottle or a ball of cable.
void add_small_thing(Scene& scene, float max_height, SeededRandom& random) {
  const float height = random.uniform(0.45F, 0.95F) * max_height;
  const Vector3f color = paint_color(random);
  if (random.chance(0.3)) {
    const auto glass = scene.plain(SurfaceClass::kObject, {color.x(), color.y(), color.z()});
    scene.cylinder({0, 0, 0}, {0, 0, 0.7F * height}, 0.04F, 0.04F, 10, glass);
    scene.cylinder({0, 0, 0.7F * height}, {0, 0, height}, 0.04F, 0.015F, 10, glass);
    return;
  }
  const auto print =
      scene.paint(SurfaceClass::kObject, kPosters, color + Vector3f::Constant(0.2F), 0.2F);
  const float half_width = random.uniform(0.03F, 0.12F);
  const float half_depth = random.uniform(0.04F, 0.1F);
  const float u = 0.2F * static_cast<float>(random.below(4));
  scene.set_uv_offset({u, 0.2F * static_cast<float>(random.below(4))});
  scene.box({-half_width, -half_depth, 0.0F}, {half_width, half_depth, height}, print,
            kSidesNoBottom);
  scene.set_uv_offset(Vector2f::Zero());
}

}  // namespace

void add_leaning_mattress(Scene& scene, const Vector3f& size_m, float lean_m,
                          SeededRandom& random) {
  const Scene::Object object(scene);
  const float angle = std::asin(lean_m / size_m.z());
  // It stands on its lower back edge; the upper one touches the wall.
  const Isometry3f frame = Eigen::Translation3f(0.0F, -lean_m, 0.0F) * leaning(angle) *
                           Eigen::Translation3f(0.0F, -0.5F * size_m.y(), 0.0F);
  scene.at(frame).add(add_mattress, size_m, random.uniform(0.4F, 0.5F), random);
}

void add_mattress_stack(Scene& scene, int count, SeededRandom& random) {
  const Scene::Object object(scene);
  constexpr float kThickness_m = 0.165F;
  Eigen::Matrix3f lying;  // width along y, thickness up, length along x
  lying << 0, 0, 1, 1, 0, 0, 0, 1, 0;
  for (int i = 0; i < count; ++i) {
    const float x = random.uniform(-0.03F, 0.03F);
    const float y = random.uniform(-0.03F, 0.03F);
    const float z = kThickness_m * (static_cast<float>(i) + 0.5F);
    Isometry3f frame = standing_at({x, y, z}, random.uniform(-0.03F, 0.03F));
    frame.rotate(lying);
    frame.translate(Vector3f(0.0F, 0.0F, -1.0F));
    const auto scope = scene.at(frame);
    const bool top = i + 1 == count;
    add_mattress(scene, {1.3F, kThickness_m, 2.0F}, top ? 0.9F : 0.5F, random);
  }
}

void add_board(Scene& scene, float width_m, float height_m, float lean_rad, MaterialId front,
               MaterialId body) {
  const Scene::Object object(scene);
  constexpr float kThickness_m = 0.012F;
  const auto scope = scene.at(leaning(lean_rad));
  scene.box({0, 0, 0}, {width_m, kThickness_m, height_m}, body, kSidesAll & ~kSideFront);
  scene.box({0, 0, 0}, {width_m, kThickness_m, height_m}, front, kSideFront);
}

void add_table(Scene& scene, float width_m, float depth_m, int clutter, SeededRandom& random) {
  const Scene::Object object(scene);
  constexpr float kHeight_m = 0.74F;
  const auto wood = scene.paint(SurfaceClass::kFurniture, kWoodPlanks, {1.6F, 1.6F, 1.6F}, 0.8F);
  const auto metal = scene.plain(SurfaceClass::kFurniture, {0.2F, 0.2F, 0.22F}, 0.05F);
  const float x = 0.5F * width_m;
  scene.box({-x, -depth_m, kHeight_m - 0.03F}, {x, 0.0F, kHeight_m}, wood);
  for (const float side : {-1.0F, 1.0F}) {
    add_leg(scene, side * (x - 0.05F), -0.05F, kHeight_m - 0.03F, metal);
    add_leg(scene, side * (x - 0.05F), 0.05F - depth_m, kHeight_m - 0.03F, metal);
  }
  for (int i = 0; i < clutter; ++i) {
    const float share =
        (static_cast<float>(i) + random.uniform(0.3F, 0.7F)) / static_cast<float>(clutter);
    const float y = -random.uniform(0.15F, depth_m - 0.12F);
    const Vector3f at(-x + 0.12F + share * (width_m - 0.24F), y, kHeight_m);
    scene.at(at, random.uniform(-0.6F, 0.6F)).add(add_small_thing, 0.32F, random);
  }
}

void add_chair(Scene& scene, SeededRandom& random) {
  const Scene::Object object(scene);
  const float shade = random.uniform(0.08F, 0.35F);
  const auto seat = scene.paint(SurfaceClass::kFurniture, kCarpet, {shade, shade, 1.2F * shade});
  const auto metal = scene.plain(SurfaceClass::kFurniture, {0.25F, 0.25F, 0.25F}, 0.1F);
  scene.box({-0.22F, -0.22F, 0.42F}, {0.22F, 0.22F, 0.47F}, seat);
  scene.box({-0.22F, 0.19F, 0.6F}, {0.22F, 0.23F, 0.95F}, seat);
  for (const float x : {-0.2F, 0.2F}) {
    add_leg(scene, x, -0.2F, 0.42F, metal);
    scene.cylinder({x, 0.21F, 0.0F}, {x, 0.21F, 0.95F}, 0.015F, 0.015F, 8, metal);
  }
}

void add_shelf(Scene& scene, float width_m, float height_m, SeededRandom& random) {
  const Scene::Object object(scene);
  constexpr float kDepth_m = 0.35F;
  constexpr float kBoard_m = 0.025F;
  constexpr float kPitch_m = 0.38F;
  const auto wood = scene.paint(SurfaceClass::kFurniture, kWoodPlanks, {1.5F, 1.5F, 1.5F}, 0.7F);
  const float x = 0.5F * width_m;
  for (const float side : {-1.0F, 1.0F}) {
    const float at = side * (x - 0.5F * kBoard_m);
    scene.box({at - 0.5F * kBoard_m, -kDepth_m, 0.0F}, {at + 0.5F * kBoard_m, 0.0F, height_m},
              wood);
  }
  scene.box({-x, -0.01F, 0.0F}, {x, 0.0F, height_m}, wood, kSideFront | kSideBack);
  for (float z = 0.08F; z < height_m; z += kPitch_m) {
    scene.box({-x + kBoard_m, -kDepth_m, z - kBoard_m}, {x - kBoard_m, -0.01F, z}, wood);
    if (z + kPitch_m > height_m) break;
    for (float at = -x + 0.16F; at < x - 0.14F; at += random.uniform(0.16F, 0.34F)) {
      if (random.chance(0.15)) continue;
      scene.at({at, -0.2F, z}, random.uniform(-0.15F, 0.15F))
          .add(add_small_thing, kPitch_m - 2.0F * kBoard_m, random);
    }
  }
}

void add_desk(Scene& scene, SeededRandom& random) {
  const Scene::Object object(scene);
  add_table(scene, 1.4F, 0.54F, 3, random);
  const auto black = scene.plain(SurfaceClass::kObject, {0.065F, 0.065F, 0.067F}, 0.06F);
  const auto picture = scene.paint(SurfaceClass::kObject, kNewsprint, {1.2F, 1.2F, 1.2F}, 0.6F);
  scene.box({-0.3F, -0.28F, 0.86F}, {0.3F, -0.24F, 1.22F}, black);
  scene.box({-0.28F, -0.285F, 0.88F}, {0.28F, -0.28F, 1.2F}, picture, kSideFront);
  scene.box({-0.1F, -0.35F, 0.74F}, {0.1F, -0.2F, 0.755F}, black);
  scene.box({-0.03F, -0.25F, 0.75F}, {0.03F, -0.22F, 0.9F}, black);
  scene.box({-0.24F, -0.5F, 0.74F}, {0.2F, -0.37F, 0.765F}, black);
  scene.box({0.4F, -0.48F, 0.0F}, {0.6F, -0.05F, 0.45F}, black, kSidesNoBottom);
}

void add_radiator(Scene& scene, float width_m) {
  const Scene::Object object(scene);
  const auto paint = scene.plain(SurfaceClass::kFurniture, {0.75F, 0.74F, 0.7F}, 0.04F);
  constexpr float kPitch_m = 0.065F;
  const int ribs = static_cast<int>(width_m / kPitch_m);
  for (int i = 0; i < ribs; ++i) {
    const float x = (static_cast<float>(i) - 0.5F * static_cast<float>(ribs)) * kPitch_m;
    const auto rib = rounded_rectangle(0.045F, 0.14F, 0.02F);
    const auto scope = scene.at({x, -0.12F, 0.0F});
    scene.extrude(rib, 0.12F, 0.78F, paint);
  }
  const float half = 0.5F * width_m;
  for (const float z : {0.18F, 0.72F})
    scene.cylinder({-half, -0.12F, z}, {half, -0.12F, z}, 0.025F, 0.025F, 8, paint);
}

void add_ladder(Scene& scene, float height_m) {
  const Scene::Object object(scene);
  const auto metal =
      scene.paint(SurfaceClass::kObject, kPaintedMetal, {0.9F, 0.9F, 0.92F}, 0.5F, 0.08F);
  constexpr float kFoot_m = 0.5F;
  const auto rail = [&](float x, float share, float y_offset) -> Vector3f {
    const float narrow = 1.0F - 0.3F * share;
    return {x * narrow, -kFoot_m * (1.0F - share) - 0.04F + y_offset, share * height_m};
  };
  for (const float x : {-0.28F, 0.28F})
    scene.cylinder(rail(x, 0.0F, 0.0F), rail(x, 1.0F, 0.0F), 0.025F, 0.025F, 8, metal);
  for (float z = 0.28F; z < height_m - 0.1F; z += 0.28F) {
    const float share = z / height_m;
    scene.cylinder(rail(-0.28F, share, 0.0F), rail(0.28F, share, 0.0F), 0.02F, 0.02F, 8, metal);
  }
}

void add_stand(Scene& scene, float height_m, SeededRandom& random) {
  const Scene::Object object(scene);
  const auto black = scene.plain(SurfaceClass::kObject, {0.07F, 0.07F, 0.07F}, 0.05F);
  constexpr float kReach_m = 0.22F;
  for (float leg = 0; leg < 3; ++leg) {
    const float angle = 2.0F * kPi * leg / 3.0F;
    scene.cylinder({kReach_m * std::cos(angle), kReach_m * std::sin(angle), 0.0F}, {0, 0, 0.5F},
                   0.015F, 0.015F, 8, black);
  }
  scene.cylinder({0, 0, 0.4F}, {0, 0, height_m}, 0.02F, 0.02F, 10, black);
  for (float clamp = 0; clamp < 5; ++clamp) {
    const float z = height_m - 0.13F * clamp;
    const float reach = random.sign() * random.uniform(0.08F, 0.14F);
    scene.box({std::min(0.0F, reach), -0.03F, z - 0.05F}, {std::max(0.0F, reach), 0.03F, z}, black);
  }
}

void add_carton(Scene& scene, const Vector3f& size_m, SeededRandom& random) {
  const Scene::Object object(scene);
  const bool white = random.chance(0.5);
  const Vector3f tint = white ? Vector3f(0.95F, 0.94F, 0.92F) : Vector3f(0.48F, 0.36F, 0.24F);
  const auto board = scene.plain(SurfaceClass::kObject, {tint.x(), tint.y(), tint.z()});
  const auto print = scene.paint(SurfaceClass::kObject, kPosters,
                                 white ? Vector3f(1.0F, 1.0F, 1.0F) : Vector3f(1.3F * tint), 0.3F);
  const Vector2f half = 0.5F * size_m.head<2>();
  scene.box({-half.x(), -half.y(), 0.0F}, {half.x(), half.y(), size_m.z()}, board, kSideTop);
  const float u = 0.3F * static_cast<float>(random.below(4));
  scene.set_uv_offset({u, 0.3F * static_cast<float>(random.below(4))});
  scene.box({-half.x(), -half.y(), 0.0F}, {half.x(), half.y(), size_m.z()}, print, kSidesAround);
  scene.set_uv_offset(Vector2f::Zero());
  const auto tape = scene.plain(SurfaceClass::kObject, {0.35F, 0.27F, 0.17F}, 0.1F);
  scene.box({-half.x(), -0.025F, size_m.z()}, {half.x(), 0.025F, size_m.z() + 0.002F}, tape);
}

void add_bucket(Scene& scene, SeededRandom& random) {
  const Scene::Object object(scene);
  const Vector3f color = paint_color(random);
  const auto plastic = scene.plain(SurfaceClass::kObject, {color.x(), color.y(), color.z()}, 0.05F);
  const auto inside = scene.plain(SurfaceClass::kObject, {0.1F, 0.1F, 0.1F});
  scene.cylinder({0, 0, 0}, {0, 0, 0.3F}, 0.11F, 0.145F, 20, plastic, false);
  scene.cylinder({0, 0, 0.24F}, {0, 0, 0.25F}, 0.138F, 0.138F, 20, inside);
}

}  // namespace km
