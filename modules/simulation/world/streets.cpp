#include "modules/simulation/world/streets.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <optional>
#include <vector>

namespace km {
namespace {

using Eigen::AlignedBox2f;
using Eigen::Vector2f;
using Eigen::Vector3f;

constexpr float kPi = std::numbers::pi_v<float>;
constexpr float kCell_m = 2.0F;       // the ground's waves bend less than 1 mm within a cell
constexpr float kMarking_m = 0.006F;  // height of paint above the road

/// A level rectangle in cells that follow the ground's waves.
void add_ground(Scene& scene, const AlignedBox2f& box, float z, MaterialId material,
                const std::function<bool(const Vector2f&)>& kept = {}) {
  const int columns = std::max(1, static_cast<int>(std::ceil(box.sizes().x() / kCell_m)));
  const int rows = std::max(1, static_cast<int>(std::ceil(box.sizes().y() / kCell_m)));
  const auto at = [&](float row, float column) {
    return Vector2f(box.min().x() + box.sizes().x() * column / static_cast<float>(columns),
                    box.min().y() + box.sizes().y() * row / static_cast<float>(rows));
  };
  scene.mesh.sheet(
      rows, columns,
      [&](int row, int column) {
        const Vector2f p = at(static_cast<float>(row), static_cast<float>(column));
        return Vector3f(p.x(), p.y(), z);
      },
      [&](int row, int column) -> std::optional<MaterialId> {
        const Vector2f middle =
            at(static_cast<float>(row) + 0.5F, static_cast<float>(column) + 0.5F);
        if (kept && !kept(middle)) return std::nullopt;
        return material;
      },
      true);
}

AlignedBox2f rectangle(float x0, float y0, float x1, float y1) {
  return {Vector2f(x0, y0), Vector2f(x1, y1)};
}

AlignedBox2f shrunk(const AlignedBox2f& box, float by) {
  return {box.min() + Vector2f::Constant(by), box.max() - Vector2f::Constant(by)};
}

/// A point of a kerb with its direction towards the road.
struct KerbPoint {
  Vector2f position;
  Vector2f out;
};

/// Counter-clockwise outline of a rectangle with rounded corners, first point repeated.
std::vector<KerbPoint> rounded_outline(const AlignedBox2f& box, float radius) {
  std::vector<KerbPoint> outline;
  const AlignedBox2f centres = shrunk(box, radius);
  for (int corner = 0; corner < 4; ++corner) {  // south-west, south-east, north-east, north-west
    const Vector2f centre(corner == 1 || corner == 2 ? centres.max().x() : centres.min().x(),
                          corner >= 2 ? centres.max().y() : centres.min().y());
    constexpr int kPieces = 8;
    for (int i = 0; i <= kPieces; ++i) {
      const float angle =
          kPi * (1.0F + 0.5F * static_cast<float>(corner) + 0.5F * static_cast<float>(i) / kPieces);
      const Vector2f out(std::cos(angle), std::sin(angle));
      outline.push_back({centre + radius * out, out});
    }
    // Straight on to the next corner in cells.
    const float yaw = 0.5F * kPi * static_cast<float>(corner);
    const Vector2f along(std::cos(yaw), std::sin(yaw));
    const float length = corner % 2 == 0 ? centres.sizes().x() : centres.sizes().y();
    const int cells = static_cast<int>(length / kCell_m);
    const KerbPoint last = outline.back();
    for (int i = 1; i < cells; ++i) {
      outline.push_back(
          {last.position + length * static_cast<float>(i) / static_cast<float>(cells) * along,
           last.out});
    }
  }
  outline.push_back(outline.front());
  return outline;
}

/// A strip along a kerb, between two distances behind it.
void add_strip(Scene& scene, const std::vector<KerbPoint>& kerb, float front, float front_z,
               float back, float back_z, MaterialId material) {
  scene.mesh.sheet(
      1, static_cast<int>(kerb.size()) - 1,
      [&](int row, int column) {
        const KerbPoint& k = kerb[static_cast<std::size_t>(column)];
        const Vector2f p = k.position - (row == 0 ? front : back) * k.out;
        return Vector3f(p.x(), p.y(), row == 0 ? front_z : back_z);
      },
      material, front_z == back_z);
}

struct GroundPaints {
  MaterialId asphalt = 0;
  MaterialId patch = 0;
  MaterialId white = 0;
  MaterialId kerb = 0;
  MaterialId pavers = 0;
  MaterialId grass = 0;
  MaterialId iron = 0;
};

GroundPaints ground_paints(Scene& scene) {
  return {scene.paint(SurfaceClass::kRoad, Recipe::kAsphalt),
          scene.paint(SurfaceClass::kRoad, Recipe::kAsphalt, {0.62F, 0.62F, 0.64F}, 0.7F),
          scene.paint(SurfaceClass::kRoad, Recipe::kPlaster, {0.78F, 0.78F, 0.75F}),
          scene.paint(SurfaceClass::kSidewalk, Recipe::kConcrete, {1.1F, 1.1F, 1.1F}, 0.5F),
          scene.paint(SurfaceClass::kSidewalk, Recipe::kPavers),
          scene.paint(SurfaceClass::kTerrain, Recipe::kGrass),
          scene.paint(SurfaceClass::kRoad, Recipe::kPaintedMetal, {0.13F, 0.12F, 0.11F}, 0.3F)};
}

void add_block_ground(Scene& scene, const AlignedBox2f& kerb_line, const GroundPaints& paints) {
  const std::vector<KerbPoint> kerb = rounded_outline(kerb_line, kCornerRadius_m);
  add_strip(scene, kerb, 0.0F, -0.06F, 0.02F, kKerb_m, paints.kerb);
  add_strip(scene, kerb, 0.02F, kKerb_m, 0.18F, kKerb_m, paints.kerb);
  add_strip(scene, kerb, 0.18F, kKerb_m, kSidewalk_m, kKerb_m, paints.pavers);
  add_ground(scene, shrunk(kerb_line, kSidewalk_m - 0.05F), kKerb_m - 0.015F, paints.grass);
}

void add_outer_ground(Scene& scene, const CityPlan& plan, const GroundPaints& paints) {
  const AlignedBox2f road = rectangle(plan.x.front() - kHalfRoad_m, plan.y.front() - kHalfRoad_m,
                                      plan.x.back() + kHalfRoad_m, plan.y.back() + kHalfRoad_m);
  std::vector<KerbPoint> kerb = rounded_outline(road, 0.5F);
  std::ranges::reverse(kerb);  // seen from inside
  for (KerbPoint& k : kerb) k.out = -k.out;
  add_strip(scene, kerb, 0.0F, -0.06F, 0.02F, kKerb_m, paints.kerb);
  add_strip(scene, kerb, 0.02F, kKerb_m, 0.18F, kKerb_m, paints.kerb);
  add_strip(scene, kerb, 0.18F, kKerb_m, kSidewalk_m + 0.8F, kKerb_m, paints.pavers);
}

/// A frame on a street: x along it in the direction of the right lane, y to the left, at the
/// crossing it leaves.
struct StreetRun {
  Eigen::Isometry3f T_world_run;
  float length_m = 0.0F;  // from crossing to crossing
};

void add_line(Scene& scene, float x0, float x1, float y, float width, MaterialId paint) {
  const int cells = std::max(1, static_cast<int>((x1 - x0) / kCell_m));
  scene.mesh.sheet(
      1, cells,
      [&](int row, int column) {
        return Vector3f(x0 + (x1 - x0) * static_cast<float>(column) / static_cast<float>(cells),
                        y + (row == 0 ? -0.5F : 0.5F) * width, kMarking_m);
      },
      paint);
}

void add_arrow(Scene& scene, float x, float y, bool forward, MaterialId paint) {
  const float d = forward ? 1.0F : -1.0F;
  const std::vector<Vector2f> outline = {
      {x, y - 0.08F * d}, {x + 2.2F * d, y - 0.08F * d}, {x + 2.2F * d, y - 0.3F * d},
      {x + 3.4F * d, y},  {x + 2.2F * d, y + 0.3F * d},  {x + 2.2F * d, y + 0.08F * d},
      {x, y + 0.08F * d}};
  scene.mesh.polygon(outline, kMarking_m, paint);
}

/// Stripes across and the line to stop at, for those who come along +x (or -x) to the crossing at
/// x.
void add_crosswalk(Scene& scene, float x, float stop_x, float stop_y, MaterialId paint) {
  for (float y = -kHalfRoad_m + 0.35F; y < kHalfRoad_m - 0.5F; y += 1.0F) {
    add_line(scene, x, x + 3.0F, y + 0.25F, 0.5F, paint);
  }
  scene.mesh.quad({stop_x, stop_y - 1.35F, kMarking_m}, {stop_x + 0.4F, stop_y - 1.35F, kMarking_m},
                  {stop_x + 0.4F, stop_y + 1.35F, kMarking_m}, {stop_x, stop_y + 1.35F, kMarking_m},
                  paint);
}

void add_markings(Scene& scene, float length, const GroundPaints& paints) {
  const float first = kHalfRoad_m + 1.2F;
  const float last = length - kHalfRoad_m - 4.2F;
  add_crosswalk(scene, first, first + 3.5F, kLaneOffset_m, paints.white);
  add_crosswalk(scene, last, last - 0.9F, -kLaneOffset_m, paints.white);
  const float begin = first + 4.6F;
  const float end = last - 1.6F;
  for (float x = begin + 6.0F; x + 2.0F < end - 6.0F; x += 4.0F) {
    add_line(scene, x, x + 2.0F, 0.0F, 0.13F, paints.white);
  }
  add_line(scene, begin - 0.7F, begin + 5.0F, 0.0F, 0.13F, paints.white);
  add_line(scene, end - 5.0F, end + 0.7F, 0.0F, 0.13F, paints.white);
  for (const float side : {-1.0F, 1.0F}) {
    for (float x = begin; x < end - 0.3F; x += 5.4F) {  // parking bays
      add_line(scene, x, std::min(x + 5.4F, end), side * kLaneEdge_m, 0.1F, paints.white);
      scene.mesh.quad({x, side * 4.15F - 0.95F, kMarking_m},
                      {x + 0.1F, side * 4.15F - 0.95F, kMarking_m},
                      {x + 0.1F, side * 4.15F + 0.95F, kMarking_m},
                      {x, side * 4.15F + 0.95F, kMarking_m}, paints.white);
    }
  }
  add_arrow(scene, end - 9.0F, -kLaneOffset_m, true, paints.white);
  add_arrow(scene, begin + 9.0F, kLaneOffset_m, false, paints.white);
}

/// Repairs of the asphalt, manholes, drains at the kerb.
void add_wear(Scene& scene, float length, const GroundPaints& paints, SeededRandom& random) {
  const int patches = 2 + random.below(4);
  for (int i = 0; i < patches; ++i) {
    const float x = random.uniform(12.0F, length - 15.0F);
    const float y = random.uniform(-2.9F, 1.4F);
    const float width = random.uniform(0.5F, 1.5F);
    const float piece = random.uniform(0.8F, 1.9F);
    for (int k = 0; k < 1 + random.below(4); ++k) {
      const float x0 = x + static_cast<float>(k) * piece;
      scene.mesh.quad({x0, y, 0.0035F}, {x0 + piece, y, 0.0035F}, {x0 + piece, y + width, 0.0035F},
                      {x0, y + width, 0.0035F}, paints.patch);
    }
  }
  const int manholes = 2 + random.below(2);
  for (int i = 0; i < manholes; ++i) {
    const Vector3f at(random.uniform(10.0F, length - 10.0F), random.uniform(-2.6F, 2.6F), -0.05F);
    scene.mesh.cylinder(at, at + Vector3f(0.0F, 0.0F, 0.058F), 0.36F, 0.36F, 20, paints.iron);
    for (int bar = -3; bar <= 3; ++bar) {
      const float y = 0.08F * static_cast<float>(bar);
      const float half = std::sqrt(0.3F * 0.3F - y * y);
      scene.mesh.box(at + Vector3f(-half, y - 0.015F, 0.05F),
                     at + Vector3f(half, y + 0.015F, 0.064F), paints.patch, kSidesNoBottom);
    }
  }
  for (float x = 14.0F; x < length - 12.0F; x += random.uniform(14.0F, 20.0F)) {
    for (const float y : {-kHalfRoad_m + 0.05F, kHalfRoad_m - 0.4F}) {
      scene.mesh.box({x, y, -0.05F}, {x + 0.5F, y + 0.35F, 0.005F}, paints.iron, kSidesNoBottom);
    }
  }
}

std::vector<StreetRun> street_runs(const CityPlan& plan) {
  std::vector<StreetRun> runs;
  for (std::size_t i = 0; i < 4; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      runs.push_back({standing_at({plan.x[j], plan.y[i], 0.0F}, 0.0F), plan.x[j + 1] - plan.x[j]});
      runs.push_back(
          {standing_at({plan.x[i], plan.y[j], 0.0F}, 0.5F * kPi), plan.y[j + 1] - plan.y[j]});
    }
  }
  return runs;
}

}  // namespace

void add_streets(Scene& scene, const CityPlan& plan, SeededRandom& random) {
  const GroundPaints paints = ground_paints(scene);
  std::vector<AlignedBox2f> hidden;
  for (int column = 0; column < CityPlan::kBlocks; ++column) {
    for (int row = 0; row < CityPlan::kBlocks; ++row) {
      add_block_ground(scene, plan.block(column, row), paints);
      hidden.push_back(shrunk(plan.block(column, row), 2.4F));
    }
  }
  add_outer_ground(scene, plan, paints);
  add_ground(scene,
             rectangle(plan.x.front() - kHalfRoad_m - 0.1F, plan.y.front() - kHalfRoad_m - 0.1F,
                       plan.x.back() + kHalfRoad_m + 0.1F, plan.y.back() + kHalfRoad_m + 0.1F),
             0.0F, paints.asphalt, [&](const Vector2f& cell) {
               return std::ranges::none_of(
                   hidden, [&](const AlignedBox2f& box) { return box.contains(cell); });
             });
  for (const StreetRun& run : street_runs(plan)) {
    const ScopedFrame frame(scene.mesh, run.T_world_run);
    add_markings(scene, run.length_m, paints);
    add_wear(scene, run.length_m, paints, random);
  }
}

}  // namespace km
