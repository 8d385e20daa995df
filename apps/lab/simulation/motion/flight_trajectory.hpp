#pragma once

#include <Eigen/Geometry>
#include <cstdint>

#include "apps/lab/simulation/motion/spline_trajectory.hpp"
#include "modules/core/config.hpp"

namespace km {

/// Style of a multicopter flight. The defaults resemble the easy and medium sequences of EuRoC's
/// Vicon room.
struct FlightOptions {
  static constexpr const char* kSection = "flight";

  std::uint64_t seed = 1;
  double duration_s = 60.0;     ///< Duration from time 0, standstill included.
  double standstill_s = 2.0;    ///< Time exactly at rest on the ground at the start.
  double max_speed_mps = 1.0;   ///< Largest speed towards the next waypoint.
  double max_yaw_rate = 1.047;  ///< [rad/s]
  double gusts_m = 0.008;       ///< Standard deviation of the displacement by gusts [m].
  /// Rotation of the body in the vehicle's frame (x forward, y left, z up); see
  /// vehicle_from_body().
  Eigen::Matrix3d R_vehicle_body = Eigen::Matrix3d::Identity();

  void visit_fields(auto& visitor) {
    visitor.field("duration_s", duration_s, {0.1, 36000.0});
    visitor.field("standstill_s", standstill_s, {0.0, 3600.0});
    visitor.field("max_speed_mps", max_speed_mps, {0.05, 2.5});
    visitor.field("max_yaw_rate", max_yaw_rate, {0.0, 6.3});
    visitor.field("gusts_m", gusts_m, {0.0, 0.05});
  }
};

/// A flight inside `volume` (frame `world`, z up). It begins at rest on the floor, looking inwards,
/// takes off, and flies from one random waypoint to the next with changes of yaw. The vehicle's z
/// axis is along the thrust: acceleration minus gravity plus the rotors' drag, which is linear in
/// velocity. The whole curve stays in `volume`. Throws ConfigError for options out of range. Throws
/// std::invalid_argument for a volume that is empty or smaller than 1 m across, or an
/// R_vehicle_body that is no rotation.
[[nodiscard]] SplineTrajectory make_flight_trajectory(const Eigen::AlignedBox3d& volume,
                                                      const FlightOptions& options);

}  // namespace km
