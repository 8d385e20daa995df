#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "apps/lab/simulation/motion/spline_trajectory.hpp"
#include "apps/lab/simulation/world/world.hpp"
#include "modules/core/config.hpp"

namespace km {

/// Things that move through a world besides the robots.
struct TrafficConfig {
  static constexpr const char* kSection = "traffic";

  int cars = 0;
  int people = 0;

  void visit_fields(auto& visitor) {
    visitor.field("cars", cars, {0, 200}, "cars on the routes; none indoors");
    visitor.field("people", people, {0, 200},
                  "people who walk to and fro, across or along the routes");
  }
};

/// Things that move, and where they are. Time 0 is the first image.
struct Traffic {
  World shapes;  ///< Its objects are the things, each in its own frame; empty: nothing moves.
  std::vector<std::unique_ptr<const BodyTrajectory>> ways;  ///< One for each object; see poses().

  /// T_world_object of each object.
  [[nodiscard]] std::vector<SE3> poses(double t_s) const;
};

/// Pose of a robot at a time since the first image.
using RobotWay = std::function<SE3(double)>;

/// Up to the configured numbers of cars and people over `duration_s`. Cars drive along the routes
/// in both directions, on the right-hand side; x forward, origin on the ground. People face -y.
/// None comes near a robot or another mover: ways that do are drawn again, and left out after some
/// attempts. Throws ConfigError.
[[nodiscard]] Traffic make_traffic(const World& world, const TrafficConfig& config,
                                   const std::vector<RobotWay>& robots, double duration_s,
                                   std::uint64_t seed);

}  // namespace km
