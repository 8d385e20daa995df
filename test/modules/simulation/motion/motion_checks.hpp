#pragma once

#include <catch2/catch.hpp>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <random>

#include "modules/core/lie.hpp"
#include "modules/simulation/motion/body_trajectory.hpp"

namespace km {

/// Largest differences between the derivatives a trajectory states and central differences of its
/// poses and velocities.
struct DerivativeErrors {
  double velocity = 0.0;          ///< [m/s]
  double acceleration = 0.0;      ///< [m/s^2]
  double angular_velocity = 0.0;  ///< [rad/s]
};

inline DerivativeErrors derivative_errors(const BodyTrajectory& trajectory, int samples,
                                          double h_s) {
  std::mt19937_64 engine(5);
  DerivativeErrors worst;
  const double span = trajectory.end_s() - trajectory.start_s() - 2.0 * h_s;
  for (int k = 0; k < samples; ++k) {
    const double unit = static_cast<double>(engine() >> 11) * 0x1.0p-53;
    const double t = trajectory.start_s() + h_s + span * unit;
    const BodyMotion now = trajectory.motion(t);
    const BodyMotion before = trajectory.motion(t - h_s);
    const BodyMotion after = trajectory.motion(t + h_s);
    const Eigen::Vector3d velocity =
        (after.T_world_body.translation() - before.T_world_body.translation()) / (2.0 * h_s);
    const Eigen::Vector3d acceleration =
        (after.velocity_world - before.velocity_world) / (2.0 * h_s);
    const Eigen::Matrix3d R_now_T = now.T_world_body.linear().transpose();
    const Eigen::Vector3d rate = (so3_log(R_now_T * after.T_world_body.linear()) -
                                  so3_log(R_now_T * before.T_world_body.linear())) /
                                 (2.0 * h_s);
    worst.velocity = std::max(worst.velocity, (velocity - now.velocity_world).norm());
    worst.acceleration =
        std::max(worst.acceleration, (acceleration - now.acceleration_world).norm());
    worst.angular_velocity =
        std::max(worst.angular_velocity, (rate - now.angular_velocity_body).norm());
  }
  return worst;
}

/// The body does not move at all from `from_s` to `to_s`.
inline void check_at_rest(const BodyTrajectory& trajectory, double from_s, double to_s) {
  const SE3 T_start = trajectory.motion(from_s).T_world_body;
  constexpr double kRounding = 1e-9;  // of second derivatives: 1e-16 over the interval squared
  for (double t = from_s; t <= to_s; t += 0.01) {
    const BodyMotion motion = trajectory.motion(t);
    CAPTURE(t);
    CHECK(motion.T_world_body.isApprox(T_start, 1e-12));
    CHECK(motion.velocity_world.norm() < kRounding);
    CHECK(motion.acceleration_world.norm() < kRounding);
    CHECK(motion.angular_velocity_body.norm() < kRounding);
  }
}

}  // namespace km
