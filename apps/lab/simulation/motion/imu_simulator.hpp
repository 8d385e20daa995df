#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "apps/lab/simulation/motion/sensor_errors.hpp"
#include "apps/lab/simulation/motion/spline_trajectory.hpp"
#include "modules/core/camera/camera.hpp"
#include "modules/core/camera/frame.hpp"
#include "modules/core/stamp.hpp"

namespace km {

/// Parameters of the simulated inertial samples.
struct ImuSimulation {
  ImuNoise noise;         ///< Its rate_hz is the sampling rate.
  InertialErrors errors;  ///< Beyond white noise and bias walk; default: none.
  std::uint64_t seed = 1;
  double initial_gyro_bias = 0.03;   ///< Standard deviation per axis at the start [rad/s].
  double initial_accel_bias = 0.05;  ///< Standard deviation per axis at the start [m/s^2].
};

/// A sample and its biases with their drift by temperature, which EuRoC's ground-truth state lists.
struct SimulatedImu {
  ImuSample sample;
  Eigen::Vector3d gyro_bias = Eigen::Vector3d::Zero();   ///< [rad/s]
  Eigen::Vector3d accel_bias = Eigen::Vector3d::Zero();  ///< [m/s^2]
};

/// Samples of an inertial sensor in the body's origin over the whole of `trajectory`, at epoch + k
/// / rate for all integers k within the trajectory. Stamps are rounded to nanoseconds, and the
/// motion is that at the rounded stamp:
///   gyro = M_g w + b_g + n_g + v_g,   accel = M_a R^T (a - g) + b_a + n_a + v_a,
/// with the matrices M and vibrations v of `errors`.
/// White noise and bias walk in discrete time as in Kalibr's IMU noise model: standard deviations
/// density / sqrt(dt) and walk * sqrt(dt).
[[nodiscard]] std::vector<SimulatedImu> simulate_imu(const BodyTrajectory& trajectory, Stamp epoch,
                                                     const ImuSimulation& options);

}  // namespace km
