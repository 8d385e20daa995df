#pragma once

#include <cstdint>
#include <functional>

#include "apps/lab/simulation/motion/spline_trajectory.hpp"
#include "apps/lab/simulation/world/world.hpp"

namespace km {

/// A car in town.
struct VehicleOptions {
  std::uint64_t seed = 1;     ///< Seed of speed changes, stops, steering and the road's roughness.
  double duration_s = 60.0;   ///< Duration of the whole trajectory, including the standstill.
  double start_m = 0.0;       ///< Distance of the start along the route from its first point [m].
  double standstill_s = 2.0;  ///< Exactly at rest at the start.
  double rig_height_m = 1.5;  ///< Origin of the body above the ground.
};

/// A vehicle that drives along `route`, once around and further, from time 0 to `duration_s` or a
/// few milliseconds more. Body: x forward, y left, z up. Heading is the path's tangent. Pitch and
/// roll are those of the ground under four wheels, smoothed by a suspension. The suspension is
/// excited by the ground, the road's roughness and the vehicle's accelerations.
///
/// The limits hold for the path of the point on the ground below the body; the body itself sways
/// above it by a few centimetres.
[[nodiscard]] SplineTrajectory make_vehicle_trajectory(
    const Route& route, const std::function<double(double, double)>& ground_height,
    const VehicleOptions& options);

}  // namespace km
