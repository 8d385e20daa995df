#include <catch2/catch.hpp>

#include <cmath>
#include <cstddef>
#include <limits>
#include <stdexcept>
#include <vector>

#include "modules/core/lie.hpp"
#include "modules/simulation/motion/flight_trajectory.hpp"
#include "modules/simulation/motion/imu_simulator.hpp"
#include "modules/simulation/motion/vehicle_trajectory.hpp"
#include "modules/vio/preintegration.hpp"

namespace km {
namespace {

constexpr Stamp kEpoch = 1403636579763555584;

SplineTrajectory standing(double duration_s, const SE3& T_world_body) {
  return spline_along(0.0, 1.0,
                      std::vector<SE3>(static_cast<std::size_t>(duration_s) + 5, T_world_body));
}

std::vector<ImuSample> samples_of(const std::vector<SimulatedImu>& simulated) {
  std::vector<ImuSample> samples;
  for (const SimulatedImu& s : simulated) samples.push_back(s.sample);
  return samples;
}

// Largest errors of the state predicted over each second by preintegrated noise-free samples.
struct PredictionErrors {
  double rotation = 0.0, velocity = 0.0, position = 0.0;
};

PredictionErrors predict_seconds(const BodyTrajectory& trajectory, double rate_hz) {
  ImuSimulation options;
  options.ideal = true;
  options.noise.rate_hz = rate_hz;
  const std::vector<ImuSample> samples = samples_of(simulate_imu(trajectory, kEpoch, options));
  PredictionErrors worst;
  for (int second = 0; second + 1 <= static_cast<int>(trajectory.end_s()); ++second) {
    const Stamp from = kEpoch + second * Stamp{1'000'000'000}, to = from + 1'000'000'000;
    ImuPreintegration imu(options.noise, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero());
    REQUIRE(imu.add(samples, from, to));
    const BodyMotion begin = trajectory.motion(second), end = trajectory.motion(second + 1.0);
    OdometryState state;
    state.T_odom_body = begin.T_world_body;
    state.v_odom = begin.velocity_world;
    const OdometryState reached = predict(state, imu, options.gravity_mps2);
    worst.rotation = std::max(worst.rotation, angle_of(end.T_world_body.linear().transpose() *
                                                       reached.T_odom_body.linear()));
    worst.velocity = std::max(worst.velocity, (end.velocity_world - reached.v_odom).norm());
    worst.position =
        std::max(worst.position,
                 (end.T_world_body.translation() - reached.T_odom_body.translation()).norm());
  }
  return worst;
}

TEST_CASE("Preintegrated noise-free samples of a flight reproduce it", "[motion]") {
  FlightOptions options;
  options.duration_s = 20.0;
  const SplineTrajectory flight =
      make_flight_trajectory({Eigen::Vector3d(-3, -3, 0.1), Eigen::Vector3d(3, 3, 3)}, options);
  const PredictionErrors at_200 = predict_seconds(flight, 200.0);
  CAPTURE(at_200.rotation, at_200.velocity, at_200.position);
  CHECK(at_200.rotation < 2e-5);  // [rad]
  CHECK(at_200.velocity < 2e-4);  // [m/s]
  CHECK(at_200.position < 1e-4);  // [m]
  // What remains is the integration's: it falls with the square of the sampling period.
  const PredictionErrors at_1000 = predict_seconds(flight, 1000.0);
  CHECK(at_1000.velocity < at_200.velocity / 15.0);
  CHECK(at_1000.position < at_200.position / 15.0);
}

TEST_CASE("Preintegrated noise-free samples of a drive reproduce it", "[motion]") {
  VehicleOptions options;
  options.duration_s = 20.0;
  const Route route{{{0, 0}, {80, 0}, {80, 60}, {0, 60}}, 7.0};
  const SplineTrajectory drive = make_vehicle_trajectory(route, nullptr, options);
  const PredictionErrors errors = predict_seconds(drive, 200.0);
  CAPTURE(errors.rotation, errors.velocity, errors.position);
  CHECK(errors.rotation < 1e-4);
  CHECK(errors.velocity < 2e-3);
  CHECK(errors.position < 1e-3);
}

TEST_CASE("At rest the ideal sensor measures minus gravity in the body's frame", "[motion]") {
  const SE3 T = make_pose(so3_exp({0.3, -0.7, 1.9}), {1.0, 2.0, 3.0});
  ImuSimulation options;
  options.ideal = true;
  const auto samples = simulate_imu(standing(8.0, T), kEpoch, options);
  REQUIRE(samples.size() > 1000);
  const Eigen::Vector3d up = T.linear().transpose() * Eigen::Vector3d(0, 0, 9.81);
  for (const SimulatedImu& s : samples) {
    CHECK((s.sample.accel - up).norm() < 1e-9);
    CHECK(s.sample.gyro.norm() < 1e-9);
    CHECK(s.gyro_bias.isZero());
    CHECK(s.accel_bias.isZero());
  }
}

TEST_CASE("Samples lie on the grid of the rate, rounded to nanoseconds", "[motion]") {
  ImuSimulation options;
  options.noise.rate_hz = 300.0;  // a period that is no whole number of nanoseconds
  const auto samples = simulate_imu(standing(2.0, SE3::Identity()), kEpoch, options);
  REQUIRE(samples.size() >= 601);
  CHECK(samples[0].sample.stamp == kEpoch);
  CHECK(samples[1].sample.stamp == kEpoch + 3333333);
  CHECK(samples[2].sample.stamp == kEpoch + 6666667);
  CHECK(samples[600].sample.stamp == kEpoch + 2000000000);
}

TEST_CASE("White noise has the density that was asked for", "[motion]") {
  ImuSimulation options;
  options.seed = GENERATE(1U, 2U);
  CAPTURE(options.seed);
  options.noise.gyro_random_walk = options.noise.accel_random_walk = 0.0;
  const auto samples = simulate_imu(standing(300.0, SE3::Identity()), kEpoch, options);
  double gyro = 0.0, accel = 0.0, neighbours = 0.0;
  Eigen::Vector3d previous = Eigen::Vector3d::Zero();
  for (const SimulatedImu& s : samples) {
    const Eigen::Vector3d gyro_error = s.sample.gyro - s.gyro_bias;
    const Eigen::Vector3d accel_error = s.sample.accel - Eigen::Vector3d(0, 0, 9.81) - s.accel_bias;
    gyro += gyro_error.squaredNorm();
    accel += accel_error.squaredNorm();
    neighbours += gyro_error.dot(previous);
    previous = gyro_error;
  }
  const double count = 3.0 * static_cast<double>(samples.size());
  // 180,000 draws: the standard deviation is known to 1 / sqrt(2 n) = 0.17 %, checked to 6 of
  // these.
  CHECK(std::sqrt(gyro / count) == Approx(1.6968e-04 * std::sqrt(200.0)).epsilon(0.01));
  CHECK(std::sqrt(accel / count) == Approx(2.0e-3 * std::sqrt(200.0)).epsilon(0.01));
  CHECK(std::abs(neighbours / gyro) < 0.015);  // white: 6 / sqrt(n)
}

TEST_CASE("The variance of the biases grows linearly in time", "[motion]") {
  // Increments over lags of 1, 4 and 16 s, over many seeds and axes, against walk^2 * lag.
  constexpr double kGyroWalk = 1.9393e-05, kAccelWalk = 3.0e-3;
  const SplineTrajectory still = standing(16.0, SE3::Identity());
  ImuSimulation options;
  for (const int lag_s : {1, 4, 16}) {
    double gyro = 0.0, accel = 0.0;
    int count = 0;
    for (std::uint64_t seed = 0; seed < 150; ++seed) {
      options.seed = seed;
      const auto samples = simulate_imu(still, kEpoch, options);
      const auto lag = static_cast<std::size_t>(200 * lag_s);
      for (std::size_t k = 0; k + lag < samples.size(); k += lag) {
        gyro += (samples[k + lag].gyro_bias - samples[k].gyro_bias).squaredNorm();
        accel += (samples[k + lag].accel_bias - samples[k].accel_bias).squaredNorm();
        count += 3;
      }
    }
    CAPTURE(lag_s, count);
    // At least 450 increments: the variance is known to sqrt(2 / n) = 6.7 %, checked to 4 of these.
    const double tolerance = 4.0 * std::sqrt(2.0 / count);
    CHECK(gyro / count == Approx(kGyroWalk * kGyroWalk * lag_s).epsilon(tolerance));
    CHECK(accel / count == Approx(kAccelWalk * kAccelWalk * lag_s).epsilon(tolerance));
  }
}

TEST_CASE("Equal seeds give equal samples, other seeds others", "[motion]") {
  const SplineTrajectory still = standing(3.0, SE3::Identity());
  ImuSimulation options;
  options.seed = 9;
  const auto a = simulate_imu(still, kEpoch, options);
  const auto b = simulate_imu(still, kEpoch, options);
  options.seed = 10;
  const auto c = simulate_imu(still, kEpoch, options);
  REQUIRE(a.size() == b.size());
  for (std::size_t k = 0; k < a.size(); ++k) {
    CHECK(a[k].sample.gyro == b[k].sample.gyro);
    CHECK(a[k].sample.accel == b[k].sample.accel);
    CHECK(a[k].sample.gyro != c[k].sample.gyro);
  }
}

TEST_CASE("The IMU simulator refuses rates and noises without sense", "[motion]") {
  const SplineTrajectory still = standing(1.0, SE3::Identity());
  const auto refused = [&](auto change) {
    ImuSimulation options;
    change(options);
    CHECK_THROWS_AS(simulate_imu(still, kEpoch, options), ConfigError);
  };
  refused([](ImuSimulation& o) { o.noise.rate_hz = 0.0; });
  refused([](ImuSimulation& o) { o.noise.rate_hz = std::numeric_limits<double>::quiet_NaN(); });
  refused([](ImuSimulation& o) { o.noise.gyro_noise_density = -1.0; });
  refused([](ImuSimulation& o) { o.noise.accel_random_walk = -1.0; });
  refused([](ImuSimulation& o) { o.initial_gyro_bias = -0.1; });
}

}  // namespace
}  // namespace km
