#include "modules/simulation/world/city_plan.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

#include "modules/simulation/world/crossing_routes.hpp"
#include "modules/simulation/world/lane.hpp"
#include "modules/simulation/world/mesh_builder.hpp"
#include "modules/simulation/world/seeded_random.hpp"

namespace km {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;
constexpr double kCruise_mps = 8.0;

/// The lane through the crossings. It starts half-way along the first street, where a vehicle may
/// stand.
Route route_over(const CityPlan& plan, std::span<const Crossing> crossings) {
  std::vector<Eigen::Vector2d> nodes;
  for (const auto& [i, j] : crossings) {
    nodes.emplace_back(plan.x[static_cast<std::size_t>(i)], plan.y[static_cast<std::size_t>(j)]);
  }
  nodes.insert(nodes.begin() + 1, 0.7 * nodes[0] + 0.3 * nodes[1]);
  Route route;
  route.points = right_hand_lane(nodes, kLaneOffset_m);
  std::rotate(route.points.begin(), route.points.begin() + 1, route.points.end());
  route.speed_mps = kCruise_mps;
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
  constexpr double kTwoPi = 2.0 * std::numbers::pi;
  return 0.32 * std::sin(kTwoPi * px / 128.0 + phases[0]) +
         0.28 * std::sin(kTwoPi * py / 104.0 + phases[1]) +
         0.06 * std::sin(kTwoPi * (px + py) / 41.0 + phases[2]) +
         0.05 * std::sin(kTwoPi * (px - 1.3 * py) / 37.0 + phases[3]);
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
  for (const std::vector<Crossing>& crossings : crossing_routes()) {
    routes.push_back(route_over(plan, crossings));
  }
  return routes;
}

}  // namespace km
