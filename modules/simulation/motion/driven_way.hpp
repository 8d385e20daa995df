#pragma once

#include <cstddef>
#include <vector>

#include "modules/simulation/motion/route_path.hpp"
#include "modules/simulation/motion/vehicle_trajectory.hpp"

namespace km {

/// The way along a path driven until each instant [m], one every kInterval_s from time 0 to a
/// little after the end.
struct DrivenWay {
  static constexpr double kInterval_s = 0.01;
  static constexpr std::size_t kBeyondEnd = 4;  ///< Values at or after the end.
  std::vector<double> way_m;
};

/// Drives along `path` from `options.start_m`: a standstill, then at most `speed_mps`, slower in
/// curves, with seeded changes of speed and stops. Accelerations change smoothly. The limits of
/// `options` hold; the fastest profile within them is taken (forward and backward pass over v^2).
[[nodiscard]] DrivenWay drive(const RoutePath& path, double speed_mps,
                              const VehicleOptions& options);

}  // namespace km
