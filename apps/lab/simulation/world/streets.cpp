#include "apps/lab/simulation/world/streets.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <optional>
#include <span>
#include <vector>

#include "apps/lab/simulation/world/scene.hpp"
#include "apps/lab/simulation/world/seeded_random.hpp"
#include "apps/lab/simulation/world/world.hpp"

namespace km {
namespace {

using Eigen::AlignedBox2f;
using Eigen::Vector2f;
using Eigen::Vector3f;
using enum Recipe;

constexpr double kStreetSpeed_mps = 8.0;

/// The lane through the crossings. It starts half-way along the first street, where a vehicle may
/// stand.
Route route_over(const CityPlan& plan, std::span<const Crossing> crossings) {
  std::vector<Eigen::Vector2d> nodes;
  for (const auto& [i, j] : crossings)
    nodes.emplace_back(plan.x[static_cast<std::size_t>(i)], plan.y[static_cast<std::size_t>(j)]);
  nodes.insert(nodes.begin() + 1, 0.7 * nodes[0] + 0.3 * nodes[1]);
  Route route;
  route.points = right_hand_lane(nodes, kLaneOffset_m);
  std::rotate(route.points.begin(), route.points.begin() + 1, route.points.end());
  route.speed_mps = kStreetSpeed_mps;
  return route;
}

}  // namespace

Eigen::AlignedBox2f CityPlan::block(int column, int row) const {
  const auto i = static_cast<std::size_t>(column);
  const auto j = static_cast<std::size_t>(row);
  return {Eigen::Vector2f(x[i] + kHalfRoad_m, y[j] + kHalfRoad_m),
          Eigen::Vector2f(x[i + 1] - kHalfRoad_m, y[j + 1] - kHalfRoad_m)};
}

std::array<StreetSide, 4> CityPlan::sides(const Eigen::AlignedBox2f& kerb) {
  const Eigen::Vector2f low = kerb.min() + Eigen::Vector2f::Constant(kSidewalk_m);
  const Eigen::Vector2f high = kerb.max() - Eigen::Vector2f::Constant(kSidewalk_m);
  const Eigen::Vector2f size = high - low;
  const auto side = [](float px, float py, float yaw, float length) {
    return StreetSide{standing_at({px, py, kKerb_m}, yaw), length};
  };
  return {side(low.x(), low.y(), 0.0F, size.x()), side(high.x(), low.y(), 0.5F * kPi, size.y()),
          side(high.x(), high.y(), kPi, size.x()), side(low.x(), high.y(), 1.5F * kPi, size.y())};
}

std::array<StreetSide, 4> CityPlan::outer_sides() const {
  const float out = kHalfRoad_m + kSidewalk_m;
  const Eigen::Vector2f low(x.front() - out, y.front() - out);
  const Eigen::Vector2f high(x.back() + out, y.back() + out);
  const Eigen::Vector2f size = high - low;
  const auto side = [](float px, float py, float yaw, float length) {
    return StreetSide{standing_at({px, py, kKerb_m}, yaw), length};
  };
  return {side(high.x(), low.y(), kPi, size.x()), side(high.x(), high.y(), 1.5F * kPi, size.y()),
          side(low.x(), high.y(), 0.0F, size.x()), side(low.x(), low.y(), 0.5F * kPi, size.y())};
}

std::vector<StreetSide> CityPlan::outer_pieces() const {
  std::vector<StreetSide> pieces;
  for (const StreetSide& side : outer_sides()) {
    std::vector<float> crossings;
    const Eigen::Isometry3f T_side_world = side.T_world_side.inverse();
    const bool along_x = std::abs(side.T_world_side.linear()(0, 0)) > 0.5F;
    for (std::size_t i = 0; i < x.size(); ++i) {
      const Eigen::Vector3f crossing(along_x ? x[i] : 0.0F, along_x ? 0.0F : y[i], 0.0F);
      crossings.push_back((T_side_world * crossing).x());
    }
    std::ranges::sort(crossings);
    const float out = kHalfRoad_m + kSidewalk_m;
    for (std::size_t i = 0; i + 1 < crossings.size(); ++i) {
      const float begin = crossings[i] + out;
      pieces.push_back({side.T_world_side * standing_at({begin, 0.0F, 0.0F}, 0.0F),
                        crossings[i + 1] - out - begin});
    }
  }
  return pieces;
}

double CityPlan::ground(double px, double py) const {
  constexpr double kCycle = 2.0 * std::numbers::pi;
  return 0.32 * std::sin(kCycle * px / 128.0 + phases[0]) +
         0.28 * std::sin(kCycle * py / 104.0 + phases[1]) +
         0.06 * std::sin(kCycle * (px + py) / 41.0 + phases[2]) +
         0.05 * std::sin(kCycle * (px - 1.3 * py) / 37.0 + phases[3]);
}

CityPlan make_city_plan(std::uint64_t seed) {
  SeededRandom random = SeededRandom::stream(seed, 10);
  CityPlan plan;
  // The outer columns are equally wide: the same row of houses fits into both.
  const float outer = random.uniform(58.0F, 62.0F);
  const std::array<float, 3> widths = {outer, random.uniform(60.0F, 66.0F), outer};
  const std::array<float, 3> depths = {random.uniform(44.0F, 48.0F), random.uniform(46.0F, 50.0F),
                                       random.uniform(44.0F, 48.0F)};
  plan.x[0] = -0.5F * (widths[0] + widths[1] + widths[2]);
  plan.y[0] = -0.5F * (depths[0] + depths[1] + depths[2]);
  for (std::size_t i = 0; i < 3; ++i) {
    plan.x[i + 1] = plan.x[i] + widths[i];
    plan.y[i + 1] = plan.y[i] + depths[i];
  }
  for (float& phase : plan.phases) phase = random.uniform(0.0F, 2.0F * kPi);
  return plan;
}

std::vector<Route> city_routes(const CityPlan& plan) {
  std::vector<Route> routes;
  for (const std::vector<Crossing>& crossings : crossing_routes())
    routes.push_back(route_over(plan, crossings));
  return routes;
}

namespace {

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
  const auto point = [&](float row, float column) {
    const Vector2f p = at(row, column);
    return Vector3f(p.x(), p.y(), z);
  };
  const auto cell = [&](float row, float column) -> std::optional<MaterialId> {
    const Vector2f middle = at(row + 0.5F, column + 0.5F);
    if (kept && !kept(middle)) return std::nullopt;
    return material;
  };
  scene.sheet(rows, columns, point, cell, true);
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
    for (float i = 0; i <= kPieces; ++i) {
      const float angle = kPi * (1.0F + 0.5F * static_cast<float>(corner) + 0.5F * i / kPieces);
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
  const auto point = [&](int row, int column) {
    const KerbPoint& k = kerb[static_cast<std::size_t>(column)];
    const Vector2f p = k.position - (row == 0 ? front : back) * k.out;
    return Vector3f(p.x(), p.y(), row == 0 ? front_z : back_z);
  };
  scene.sheet(1, static_cast<int>(kerb.size()) - 1, point, material, front_z == back_z);
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
  return {scene.paint(SurfaceClass::kRoad, kAsphalt),
          scene.paint(SurfaceClass::kRoad, kAsphalt, {0.62F, 0.62F, 0.64F}, 0.7F),
          scene.paint(SurfaceClass::kRoad, kPlaster, {0.78F, 0.78F, 0.75F}),
          scene.paint(SurfaceClass::kSidewalk, kConcrete, {1.1F, 1.1F, 1.1F}, 0.5F),
          scene.paint(SurfaceClass::kSidewalk, kPavers),
          scene.paint(SurfaceClass::kTerrain, kGrass),
          scene.paint(SurfaceClass::kRoad, kPaintedMetal, {0.13F, 0.12F, 0.11F}, 0.3F)};
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
  float length_m = 0.0F;  // length from crossing to crossing
};

void add_line(Scene& scene, float x0, float x1, float y, float width, MaterialId paint) {
  const int cells = std::max(1, static_cast<int>((x1 - x0) / kCell_m));
  const auto point = [&](int row, float column) {
    return Vector3f(x0 + (x1 - x0) * column / static_cast<float>(cells),
                    y + (row == 0 ? -0.5F : 0.5F) * width, kMarking_m);
  };
  scene.sheet(1, cells, point, paint);
}

void add_arrow(Scene& scene, float x, float y, bool forward, MaterialId paint) {
  const float d = forward ? 1.0F : -1.0F;
  const std::vector<Vector2f> outline = {
      {x, y - 0.08F * d}, {x + 2.2F * d, y - 0.08F * d}, {x + 2.2F * d, y - 0.3F * d},
      {x + 3.4F * d, y},  {x + 2.2F * d, y + 0.3F * d},  {x + 2.2F * d, y + 0.08F * d},
      {x, y + 0.08F * d}};
  scene.polygon(outline, kMarking_m, paint);
}

/// Stripes across the street and the stop line, for traffic along +x (or -x) to the crossing at x.
void add_crosswalk(Scene& scene, float x, float stop_x, float stop_y, MaterialId paint) {
  for (float y = -kHalfRoad_m + 0.35F; y < kHalfRoad_m - 0.5F; y += 1.0F)
    add_line(scene, x, x + 3.0F, y + 0.25F, 0.5F, paint);
  scene.quad({stop_x, stop_y - 1.35F, kMarking_m}, {stop_x + 0.4F, stop_y - 1.35F, kMarking_m},
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
  for (float x = begin + 6.0F; x + 2.0F < end - 6.0F; x += 4.0F)
    add_line(scene, x, x + 2.0F, 0.0F, 0.13F, paints.white);
  add_line(scene, begin - 0.7F, begin + 5.0F, 0.0F, 0.13F, paints.white);
  add_line(scene, end - 5.0F, end + 0.7F, 0.0F, 0.13F, paints.white);
  for (const float side : {-1.0F, 1.0F}) {
    for (float x = begin; x < end - 0.3F; x += 5.4F) {  // parking bays
      add_line(scene, x, std::min(x + 5.4F, end), side * kLaneEdge_m, 0.1F, paints.white);
      scene.quad({x, side * 4.15F - 0.95F, kMarking_m},
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
      scene.quad({x0, y, 0.0035F}, {x0 + piece, y, 0.0035F}, {x0 + piece, y + width, 0.0035F},
                 {x0, y + width, 0.0035F}, paints.patch);
    }
  }
  const int manholes = 2 + random.below(2);
  for (int i = 0; i < manholes; ++i) {
    const Vector3f at(random.uniform(10.0F, length - 10.0F), random.uniform(-2.6F, 2.6F), -0.05F);
    scene.cylinder(at, at + Vector3f(0.0F, 0.0F, 0.058F), 0.36F, 0.36F, 20, paints.iron);
    for (float bar = -3; bar <= 3; ++bar) {
      const float y = 0.08F * bar;
      const float half = std::sqrt(0.3F * 0.3F - y * y);
      scene.box(at + Vector3f(-half, y - 0.015F, 0.05F), at + Vector3f(half, y + 0.015F, 0.064F),
                paints.patch, kSidesNoBottom);
    }
  }
  for (float x = 14.0F; x < length - 12.0F; x += random.uniform(14.0F, 20.0F))
    for (const float y : {-kHalfRoad_m + 0.05F, kHalfRoad_m - 0.4F})
      scene.box({x, y, -0.05F}, {x + 0.5F, y + 0.35F, 0.005F}, paints.iron, kSidesNoBottom);
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
    const auto frame = scene.at(run.T_world_run);
    add_markings(scene, run.length_m, paints);
    add_wear(scene, run.length_m, paints, random);
  }
}

}  // namespace km
