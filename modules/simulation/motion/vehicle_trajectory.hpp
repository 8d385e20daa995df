#pragma once

#include <cstdint>
#include <functional>

#include "modules/core/config.hpp"
#include "modules/simulation/motion/spline_trajectory.hpp"
#include "modules/simulation/world/world.hpp"

namespace km {

/// How a vehicle drives. Defaults: a car in town.
struct VehicleOptions {
  static constexpr const char* kSection = "vehicle";

  std::uint64_t seed = 1;     ///< Of speed changes, stops, steering and the road's roughness.
  double duration_s = 60.0;   ///< Of the whole trajectory, standstill included.
  double start_m = 0.0;       ///< Way along the route from its first point at which it starts [m].
  double standstill_s = 2.0;  ///< Exactly at rest at the start.
  double rig_height_m = 1.5;  ///< Origin of the body above the ground.
  double corner_radius_m = 5.0;   ///< Of rounded corners, smaller where the route leaves no room.
  double max_lateral_mps2 = 2.5;  ///< In curves.
  double max_longitudinal_mps2 = 1.5;  ///< Speeding up and braking.
  double stop_every_m = 150.0;         ///< Mean way between short stops; 0: none.
  double roughness = 2.0;  ///< Of the road, ISO 8608: 1 is class A, 2 B, 4 C; 0 is smooth.

  void visit_fields(auto& visitor) {
    visitor.field("duration_s", duration_s, {0.1, 36000.0});
    visitor.field("start_m", start_m, {0.0, 1e6});
    visitor.field("standstill_s", standstill_s, {0.0, 3600.0});
    visitor.field("rig_height_m", rig_height_m, {0.0, 10.0});
    visitor.field("corner_radius_m", corner_radius_m, {0.5, 100.0});
    visitor.field("max_lateral_mps2", max_lateral_mps2, {0.1, 10.0});
    visitor.field("max_longitudinal_mps2", max_longitudinal_mps2, {0.1, 10.0});
    visitor.field("stop_every_m", stop_every_m, {0.0, 1e6});
    visitor.field("roughness", roughness, {0.0, 10.0});
  }
};

/// A vehicle that drives along `route`, once around and on, from time 0 to `duration_s` or a few
/// milliseconds more. Body: x forward, y left, z up. Heading is the path's tangent; pitch and roll
/// are the ground's under four wheels, seen through a suspension that is excited by the ground, the
/// road's roughness and the vehicle's accelerations. `ground_height` may be null: level ground at
/// 0.
///
/// The limits hold for the way of the point on the ground below the body; the body itself sways
/// above it by a few centimetres. Throws ConfigError for options out of range,
/// std::invalid_argument for a route with fewer than three points or shorter than 20 m or with a
/// speed outside 0.1 to 60 m/s.
[[nodiscard]] SplineTrajectory make_vehicle_trajectory(
    const Route& route, const std::function<double(double, double)>& ground_height,
    const VehicleOptions& options);

}  // namespace km
