#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "apps/lab/simulation/motion/inertial_errors.hpp"
#include "apps/lab/simulation/motion/spline_trajectory.hpp"
#include "modules/core/camera.hpp"
#include "modules/core/config.hpp"
#include "modules/core/frame.hpp"
#include "modules/core/stamp.hpp"

namespace km {

/// Parameters of the simulated inertial samples.
struct ImuSimulation {
  static constexpr const char* kSection = "imu";

  ImuNoise noise;         ///< Its rate_hz is the sampling rate.
  InertialErrors errors;  ///< Beyond white noise and bias walk; default: none.
  std::uint64_t seed = 1;
  bool ideal = false;                ///< Neither noise nor bias.
  double initial_gyro_bias = 0.03;   ///< Standard deviation per axis at the start [rad/s].
  double initial_accel_bias = 0.05;  ///< Standard deviation per axis at the start [m/s^2].
  double gravity_mps2 = 9.81;        ///< Gravity is [0, 0, -gravity_mps2] in `world`.

  void visit_fields(auto& visitor) {
    visitor.field("rate_hz", noise.rate_hz, {1.0, 1e5});
    visitor.field("gyro_noise_density", noise.gyro_noise_density, {0.0, 1.0});
    visitor.field("gyro_random_walk", noise.gyro_random_walk, {0.0, 1.0});
    visitor.field("accel_noise_density", noise.accel_noise_density, {0.0, 10.0});
    visitor.field("accel_random_walk", noise.accel_random_walk, {0.0, 10.0});
    visitor.field("ideal", ideal);
    visitor.field("initial_gyro_bias", initial_gyro_bias, {0.0, 1.0});
    visitor.field("initial_accel_bias", initial_accel_bias, {0.0, 10.0});
    visitor.field("gravity_mps2", gravity_mps2, {0.0, 20.0});
  }
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
/// density / sqrt(dt) and walk * sqrt(dt). Throws ConfigError for options out of range.
[[nodiscard]] std::vector<SimulatedImu> simulate_imu(const BodyTrajectory& trajectory, Stamp epoch,
                                                     const ImuSimulation& options);

}  // namespace km
