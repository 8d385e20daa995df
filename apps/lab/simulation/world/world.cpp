#include "apps/lab/simulation/world/world.hpp"

namespace km {
namespace {

LabelClass entry(SurfaceClass surface, const char* name, std::array<std::uint8_t, 3> color) {
  return {static_cast<LabelId>(surface), name, color};
}

using Eigen::Vector2d;

Vector2d right_of(const Vector2d& direction) {
  return {direction.y(), -direction.x()};
}

}  // namespace

const LabelPalette& simulation_palette() {
  static const LabelPalette palette({
      entry(SurfaceClass::kUnknown, "unknown", {0, 0, 0}),
      entry(SurfaceClass::kSky, "sky", {112, 176, 232}),
      entry(SurfaceClass::kBuilding, "building", {150, 90, 70}),
      entry(SurfaceClass::kRoad, "road", {96, 64, 128}),
      entry(SurfaceClass::kSidewalk, "sidewalk", {244, 35, 232}),
      entry(SurfaceClass::kTerrain, "terrain", {152, 251, 152}),
      entry(SurfaceClass::kVegetation, "vegetation", {70, 142, 35}),
      entry(SurfaceClass::kVehicle, "vehicle", {20, 40, 200}),
      entry(SurfaceClass::kPole, "pole", {250, 220, 0}),
      entry(SurfaceClass::kFence, "fence", {190, 153, 153}),
      entry(SurfaceClass::kTent, "tent", {0, 130, 120}),
      entry(SurfaceClass::kPerson, "person", {220, 20, 60}),
      entry(SurfaceClass::kWall, "wall", {200, 196, 170}),
      entry(SurfaceClass::kFloor, "floor", {90, 110, 130}),
      entry(SurfaceClass::kCeiling, "ceiling", {235, 235, 245}),
      entry(SurfaceClass::kFurniture, "furniture", {230, 130, 20}),
      entry(SurfaceClass::kCurtain, "curtain", {130, 0, 160}),
      entry(SurfaceClass::kObject, "object", {0, 220, 220}),
  });
  return palette;
}

std::vector<Vector2d> right_hand_lane(std::span<const Vector2d> nodes, double right_m) {
  const std::size_t n = nodes.size();
  std::vector<Vector2d> lane;
  for (std::size_t i = 0; i < n; ++i) {
    const Vector2d in = (nodes[i] - nodes[(i + n - 1) % n]).normalized();
    const Vector2d out = (nodes[(i + 1) % n] - nodes[i]).normalized();
    const double cosine = in.dot(out);
    // Intersection of the two shifted lines, along the bisector of their normals.
    lane.emplace_back(nodes[i] + right_m / (1.0 + cosine) * (right_of(in) + right_of(out)));
  }
  return lane;
}

Route opposite_route(const Route& route) {
  // The tracks of the camp are 0.2 m farther apart than the lanes of the city.
  const std::vector<Vector2d> back(route.points.rbegin(), route.points.rend());
  return {right_hand_lane(back, static_cast<double>(kLanesApart_m)), route.speed_mps};
}

std::vector<Route> crossing_routes(std::span<const float> x, std::span<const float> y,
                                   const std::array<double, 2>& start, double right_m,
                                   double speed_mps) {
  using Crossings = std::vector<std::array<std::size_t, 2>>;  // column and row
  const std::array<Crossings, 4> all = {{
      {{1, 1}, {2, 1}, {2, 2}, {1, 2}, {1, 1}, {0, 1}, {0, 2}, {1, 2}},
      {{1, 2}, {1, 1}, {2, 1}, {2, 2}, {3, 2}, {3, 1}, {2, 1}, {2, 2}},
      {{2, 2}, {2, 1}, {2, 0}, {1, 0}, {1, 1}, {2, 1}, {2, 0}, {1, 0}, {1, 1}, {1, 2}},
      {{3, 1}, {2, 1}, {2, 0}, {3, 0}, {3, 1}, {2, 1}, {2, 2}, {3, 2}},
  }};
  std::vector<Route> routes;
  for (const Crossings& crossings : all) {
    std::vector<Vector2d> nodes;
    for (const auto& [i, j] : crossings) nodes.emplace_back(x[i], y[j]);
    nodes.insert(nodes.begin() + 1, start[0] * nodes[0] + start[1] * nodes[1]);
    Route route{right_hand_lane(nodes, right_m), speed_mps};
    std::ranges::rotate(route.points, route.points.begin() + 1);
    routes.push_back(std::move(route));
  }
  return routes;
}

}  // namespace km
