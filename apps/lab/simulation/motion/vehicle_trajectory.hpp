#pragma once

#include <cstdint>
#include <functional>

#include "apps/lab/simulation/motion/spline_trajectory.hpp"
#include "apps/lab/simulation/world/world.hpp"
#include "modules/core/config.hpp"

namespace km {

/// Driving style of a vehicle. Defaults: a car in town.
struct VehicleOptions {
  static constexpr const char* kSection = "vehicle";

  std::uint64_t seed = 1;     ///< Seed of speed changes, stops, steering and the road's roughness.
  double duration_s = 60.0;   ///< Duration of the whole trajectory, including the standstill.
  double start_m = 0.0;       ///< Distance of the start along the route from its first point [m].
  double standstill_s = 2.0;  ///< Exactly at rest at the start.
  double rig_height_m = 1.5;  ///< Origin of the body above the ground.
  double corner_radius_m =
      5.0;  ///< Radius of rounded corners, smaller if the route leaves no room.
  double max_lateral_mps2 = 2.5;       ///< Limit in curves.
  double max_longitudinal_mps2 = 1.5;  ///< Limit of speeding up and braking.
  double stop_every_m = 150.0;         ///< Mean distance between short stops; 0: none.
  double roughness =
      2.0;  ///< Roughness of the road, ISO 8608: 1 is class A, 2 B, 4 C; 0 is smooth.

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

/// A vehicle that drives along `route`, once around and further, from time 0 to `duration_s` or a
/// few milliseconds more. Body: x forward, y left, z up. Heading is the path's tangent. Pitch and
/// roll are those of the ground under four wheels, filtered by a suspension. The suspension is
/// excited by the ground, the road's roughness and the vehicle's accelerations. If `ground_height`
/// is null, the ground is level at 0.
///
/// The limits hold for the path of the point on the ground below the body; the body itself sways
/// above it by a few centimetres. Throws ConfigError for options out of range,
/// std::invalid_argument for a route with fewer than three points or shorter than 20 m or with a
/// speed outside 0.1 to 60 m/s.
[[nodiscard]] SplineTrajectory make_vehicle_trajectory(
    const Route& route, const std::function<double(double, double)>& ground_height,
    const VehicleOptions& options);

}  // namespace km
