#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <span>

#include "apps/lab/simulation/motion/spline_trajectory.hpp"
#include "modules/core/data/stamped_pose.hpp"

namespace km {

struct FlightOptions {
  std::uint64_t seed = 1;
  double duration_s = 60.0;  ///< Duration from time 0, standstill included.
  /// Rotation of the body in the vehicle's frame (x forward, y left, z up); see
  /// vehicle_from_body().
  Eigen::Matrix3d R_vehicle_body = Eigen::Matrix3d::Identity();
};

/// A flight like the easy and medium ones of EuRoC's Vicon room inside `volume` (frame `world`, z
/// up). It begins at rest on the floor, looking inwards, takes off, and flies from one random
/// waypoint to the next with changes of yaw. The vehicle's z axis is along the thrust: acceleration
/// minus gravity plus the rotors' drag, which is linear in velocity. The whole curve stays in
/// `volume`.
[[nodiscard]] SplineTrajectory make_flight_trajectory(const Eigen::AlignedBox3d& volume,
                                                      const FlightOptions& options);

/// A smooth motion through recorded poses, by penalised and robust linear least squares. It passes
/// within the noise of the poses. Time 0 of the trajectory is `epoch`, so that stamps of images and
/// inertial data convert by seconds_between(epoch, stamp). The curve covers the first to the last
/// pose. Precondition: `poses` are at least two and ascend strictly in time. O(poses).
[[nodiscard]] SplineTrajectory fit_recording(std::span<const StampedPose> poses, Stamp epoch);

}  // namespace km
