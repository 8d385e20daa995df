#include "apps/lab/simulation/world/routes.hpp"

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <string>

#include "apps/lab/simulation/world/places.hpp"
#include "apps/lab/simulation/world/streets.hpp"

namespace km {
namespace {

using Eigen::Vector2d;

Vector2d right_of(const Vector2d& direction) {
  return {direction.y(), -direction.x()};
}

}  // namespace

std::vector<Vector2d> right_hand_lane(std::span<const Vector2d> nodes, double right_m) {
  const std::size_t n = nodes.size();
  if (n < 3) {
    throw std::invalid_argument("right_hand_lane: a closed way needs 3 nodes, not " +
                                std::to_string(n));
  }
  std::vector<Vector2d> lane;
  for (std::size_t i = 0; i < n; ++i) {
    const Vector2d in = (nodes[i] - nodes[(i + n - 1) % n]).normalized();
    const Vector2d out = (nodes[(i + 1) % n] - nodes[i]).normalized();
    const double cosine = in.dot(out);
    if (!(cosine > -0.95)) {
      throw std::invalid_argument("right_hand_lane: the way stands or turns back at node " +
                                  std::to_string(i));
    }
    // Intersection of the two shifted lines, along the bisector of their normals.
    lane.emplace_back(nodes[i] + right_m / (1.0 + cosine) * (right_of(in) + right_of(out)));
  }
  return lane;
}

double lane_apart_m(const World& world) {
  // The tracks of the camp are 0.2 m farther apart than the lanes of the city.
  return world.ground_height ? 2.0 * static_cast<double>(kLaneOffset_m) : 0.0;
}

Route opposite_route(const Route& route, double apart_m) {
  const std::vector<Vector2d> back(route.points.rbegin(), route.points.rend());
  return {right_hand_lane(back, apart_m), route.speed_mps};
}

const std::array<std::vector<Crossing>, 4>& crossing_routes() {
  static const std::array<std::vector<Crossing>, 4> kRoutes = {{
      {{1, 1}, {2, 1}, {2, 2}, {1, 2}, {1, 1}, {0, 1}, {0, 2}, {1, 2}},
      {{1, 2}, {1, 1}, {2, 1}, {2, 2}, {3, 2}, {3, 1}, {2, 1}, {2, 2}},
      {{2, 2}, {2, 1}, {2, 0}, {1, 0}, {1, 1}, {2, 1}, {2, 0}, {1, 0}, {1, 1}, {1, 2}},
      {{3, 1}, {2, 1}, {2, 0}, {3, 0}, {3, 1}, {2, 1}, {2, 2}, {3, 2}},
  }};
  return kRoutes;
}

}  // namespace km
