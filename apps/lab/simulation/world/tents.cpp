#include <cmath>
#include <span>
#include <vector>

#include "apps/lab/simulation/world/objects.hpp"

namespace km {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;
using enum Recipe;

constexpr SurfaceClass kTentLabel = SurfaceClass::kTent;

struct Point {
  float x, z;
};
constexpr Point kRidgeOutline[] = {{1.6F, -0.4F}, {1.5F, 0.15F}, {0.75F, 1.1F}, {0.0F, 2.05F}};
constexpr Point kHouseOutline[] = {{2.5F, -0.5F}, {2.5F, 1.75F}, {1.25F, 2.3F}, {0.0F, 3.0F}};
constexpr Point kTunnelOutline[] = {{3.0F, -0.5F},  {3.0F, 0.0F},   {2.85F, 0.96F}, {2.43F, 1.82F},
                                    {1.76F, 2.51F}, {0.93F, 2.95F}, {0.0F, 3.1F}};
constexpr Point kPorchOutline[] = {{0.9F, -0.4F}, {0.85F, 1.2F}, {0.0F, 1.75F}};

/// The right half of the section, and the sizes.
struct TentShape {
  std::span<const Point> half;
  float length_m;
  int bays;
  float sag;  ///< Share by which the canvas sags between ribs.
  float door_width_m, door_height_m;
  float guy_m;  ///< Height at which ropes hold the walls; 0: none.
};

// By Tent; the last one is the porch of a dome.
constexpr TentShape kShapes[] = {{kRidgeOutline, 4.0F, 2, 0.035F, 0.9F, 1.5F, 0.2F},
                                 {kHouseOutline, 8.0F, 4, 0.012F, 1.6F, 2.0F, 1.7F},
                                 {kTunnelOutline, 10.8F, 6, 0.025F, 2.2F, 2.3F, 0.0F},
                                 {kPorchOutline, 1.6F, 1, 0.0F, 1.5F, 1.2F, 0.0F}};

/// From right (+x) to left, seen from the door.
std::vector<Vector2f> outline_of(const TentShape& shape) {
  std::vector<Vector2f> outline;
  for (const Point& p : shape.half) outline.emplace_back(p.x, p.z);
  for (std::size_t i = shape.half.size() - 1; i-- > 0;)
    outline.emplace_back(-shape.half[i].x, shape.half[i].z);
  return outline;
}

/// Canvas over ribs, flat ends, and a dark door with rolled flaps.
void add_shelter(Scene& scene, const TentShape& shape, MaterialId cloth) {
  const std::vector<Vector2f> outline = outline_of(shape);
  const int rows = 4 * shape.bays;
  const int columns = static_cast<int>(outline.size()) - 1;
  const auto point = [&](float row, int column) {
    const float share = row / static_cast<float>(rows);
    const float between = std::abs(std::sin(kPi * share * static_cast<float>(shape.bays)));
    const Vector2f& p = outline[static_cast<std::size_t>(columns - column)];
    const float keep = p.y() > 0.3F ? 1.0F - shape.sag * between : 1.0F;
    return Vector3f(keep * p.x(), share * shape.length_m, keep * p.y());
  };
  scene.sheet(rows, columns, point, cloth);
  for (std::size_t i = 0; i + 1 < outline.size(); ++i) {
    const auto at = [&](const Vector2f& p, float y) { return Vector3f(p.x(), y, p.y()); };
    const Vector2f foot(0.0F, outline.front().y());
    scene.triangle(at(foot, 0.02F), at(outline[i], 0.02F), at(outline[i + 1], 0.02F), cloth);
    const float back = shape.length_m - 0.02F;
    scene.triangle(at(foot, back), at(outline[i + 1], back), at(outline[i], back), cloth);
  }
  const auto dark = scene.plain(kTentLabel, {0.03F, 0.03F, 0.028F});
  const float half = 0.5F * shape.door_width_m;
  const float top = shape.door_height_m;
  scene.quad({-half, 0.01F, -0.3F}, {half, 0.01F, -0.3F}, {0.7F * half, 0.01F, top},
             {-0.7F * half, 0.01F, top}, dark);
  for (const float side : {-half, half})
    scene.cylinder({side, -0.06F, -0.2F}, {0.72F * side, -0.04F, top}, 0.09F, 0.06F, 8, cloth);
}

/// Ropes from the walls to pegs in the ground.
void add_ropes(Scene& scene, const TentShape& shape) {
  const auto rope = scene.plain(kTentLabel, {0.55F, 0.52F, 0.45F});
  const float out = shape.half[1].x;
  for (int rib = 0; rib <= shape.bays; ++rib) {
    const float y =
        0.02F + (shape.length_m - 0.04F) * static_cast<float>(rib) / static_cast<float>(shape.bays);
    for (const float side : {-1.0F, 1.0F}) {
      const Vector3f peg(side * (out + 0.5F + 0.5F * shape.guy_m), y, -0.05F);
      scene.cylinder({side * out, y, shape.guy_m}, peg, 0.012F, 0.012F, 5, rope, false);
      scene.box(peg - Vector3f(0.025F, 0.025F, 0.1F), peg + Vector3f(0.025F, 0.025F, 0.17F), rope);
    }
  }
}

}  // namespace

void add_tent(Scene& scene, Tent tent, const Vector3f& cloth) {
  const Scene::Object object(scene);
  const TentShape& shape = kShapes[static_cast<std::size_t>(tent)];
  const auto canvas = scene.paint(kTentLabel, kCanvas, cloth);
  if (tent == Tent::kDome) {
    const Vector2f profile[] = {{2.6F, -0.4F}, {2.55F, 0.35F}, {2.1F, 1.15F},
                                {1.2F, 1.8F},  {0.5F, 2.0F},   {0.0F, 2.05F}};
    scene.revolve(profile, 20, canvas);
    scene.at({0.0F, -2.7F, 0.0F}).add(add_shelter, shape, canvas);
    return;
  }
  add_shelter(scene, shape, canvas);
  if (shape.guy_m > 0.0F) add_ropes(scene, shape);
}

}  // namespace km
