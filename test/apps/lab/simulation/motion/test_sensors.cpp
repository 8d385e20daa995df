#include <catch2/catch.hpp>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <vector>

#include "apps/lab/simulation/motion/default_rig.hpp"
#include "apps/lab/simulation/motion/depth_sensor.hpp"
#include "apps/lab/simulation/motion/flight_trajectory.hpp"
#include "apps/lab/simulation/motion/imu_simulator.hpp"
#include "apps/lab/simulation/motion/vehicle_trajectory.hpp"
#include "modules/core/lie.hpp"
#include "modules/vio/preintegration.hpp"

namespace km {
namespace {

TEST_CASE("The flying rig at 752x480 is EuRoC's as published", "[motion]") {
  const SensorRig rig = default_rig(RigKind::kFlying, 752, 480);
  const Camera& left = rig.stereo.cameras[0];
  CHECK(left.fx == Approx(458.654));
  CHECK(left.fy == Approx(457.296));
  CHECK(left.cx == Approx(367.215));
  CHECK(left.cy == Approx(248.375));
  CHECK(left.lens.coefficients()[0] == -0.28340811);
  CHECK(rig.stereo.cameras[1].cx == Approx(379.999));
  CHECK(rig.stereo.baseline_m() == Approx(0.110).margin(0.0005));
  CHECK(rig.imu.gyro_noise_density == 1.6968e-04);
  CHECK(rig.imu.rate_hz == 200.0);
  for (const Camera& camera : rig.stereo.cameras) {
    const Eigen::Matrix3d R = camera.T_body_cam.linear();
    CHECK((R * R.transpose()).isIdentity(1e-12));
    CHECK(R.determinant() == Approx(1.0));
  }
}

TEST_CASE("At another resolution a bearing falls on the same part of the image", "[motion]") {
  const RigKind kind = GENERATE(RigKind::kFlying, RigKind::kVehicle);
  const Camera full = default_rig(kind, 752, 480).stereo.cameras[0];
  const Camera half = default_rig(kind, 376, 240).stereo.cameras[0];
  CHECK(half.width == 376);
  CHECK(half.height == 240);
  for (const Eigen::Vector2d& bearing :
       {Eigen::Vector2d(0, 0), Eigen::Vector2d(0.5, -0.3), Eigen::Vector2d(-0.6, 0.4)}) {
    // The edge of the image is at -0.5 px at either resolution.
    const Eigen::Vector2d at_full = full.project(bearing).value(),
                          at_half = half.project(bearing).value();
    CHECK((at_full.x() + 0.5) / 2.0 - 0.5 == Approx(at_half.x()).margin(1e-9));
    CHECK((at_full.y() + 0.5) / 2.0 - 0.5 == Approx(at_half.y()).margin(1e-9));
  }
  // Another aspect: cut around the centre.
  const Camera flat = default_rig(kind, 752, 400).stereo.cameras[0];
  CHECK(flat.fx == Approx(full.fx));
  CHECK(flat.cx == Approx(full.cx));
  CHECK(flat.cy == Approx(full.cy - 40.0));
}

TEST_CASE("Both rigs look forward, left of the vehicle on the left", "[motion]") {
  const RigKind kind = GENERATE(RigKind::kFlying, RigKind::kVehicle);
  const Eigen::Matrix3d R_vehicle_body = vehicle_from_body(kind);
  CHECK((R_vehicle_body * R_vehicle_body.transpose()).isIdentity(1e-12));
  CHECK(R_vehicle_body.determinant() == Approx(1.0));
  const SensorRig rig = default_rig(kind, 752, 480);
  Eigen::Matrix3d R_vehicle_cam;  // z forward, x right, y down
  R_vehicle_cam << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  for (const Camera& camera : rig.stereo.cameras) {
    const Eigen::Matrix3d R = R_vehicle_body * camera.T_body_cam.linear();
    CHECK(angle_of(R_vehicle_cam.transpose() * R) < 0.05);  // mounted to 3 degrees
  }
  const Eigen::Vector3d to_right = rig.stereo.T_left_right().translation();
  CHECK(to_right.x() == Approx(rig.stereo.baseline_m()).epsilon(0.01));
}

TEST_CASE("The vehicle's rig has a street's baseline", "[motion]") {
  const SensorRig rig = default_rig(RigKind::kVehicle, 752, 480);
  CHECK(rig.stereo.baseline_m() == Approx(0.27));
  const DepthSensorOptions depth = depth_options(rig);
  CHECK(depth.baseline_m == Approx(0.27));
  CHECK(depth.focal_px == Approx(458.654));
  SensorRig ranged = rig;
  ranged.depth = DepthRange{0.5, 12.0};
  CHECK(depth_options(ranged).min_range_m == 0.5);
  CHECK(depth_options(ranged).max_range_m == 12.0);
}

TEST_CASE("A rig refuses resolutions without sense", "[motion]") {
  CHECK_THROWS_AS(default_rig(RigKind::kFlying, 0, 480), std::invalid_argument);
  CHECK_THROWS_AS(default_rig(RigKind::kVehicle, 752, -1), std::invalid_argument);
  CHECK_THROWS_AS(default_rig(RigKind::kVehicle, 100000, 480), std::invalid_argument);
}

constexpr int kWidth = 320, kHeight = 240;
constexpr std::size_t kPixels = 320 * 240;

std::vector<float> plane(double z_m) {
  return std::vector<float>(kPixels, static_cast<float>(z_m));
}

TEST_CASE("The ideal depth sensor only rounds to millimetres", "[motion]") {
  DepthSensorOptions options;
  options.ideal = true;
  const DepthSensor sensor(options);
  const std::vector<float> depth = {0.0F, 0.0004F, 1.2344F, 1.2346F, 65.535F, 65.6F};
  const std::vector<std::uint16_t> expected = {0, 0, 1234, 1235, 65535, 0};
  CHECK(sensor.measure(depth, 3, 2, 1) == expected);
}

TEST_CASE("The error of depth grows with the square of range", "[motion]") {
  DepthSensorOptions options;
  options.disparity_step_px = GENERATE(0.0, 1.0 / 16);
  options.correlation_px = GENERATE(1, 4);
  CAPTURE(options.disparity_step_px, options.correlation_px);
  const DepthSensor sensor(options);
  // Rounding to steps adds the variance of a uniform distribution; here noise hides the steps.
  const double step = options.disparity_step_px;
  const double sigma_d = std::sqrt(0.15 * 0.15 + step * step / 12.0);
  for (const double z : {2.0, 4.0, 8.0}) {
    CAPTURE(z);
    double sum = 0.0, squares = 0.0;
    int count = 0;
    for (std::uint64_t seed = 0; seed < 4; ++seed)
      for (const std::uint16_t mm : sensor.measure(plane(z), kWidth, kHeight, seed)) {
        if (mm == 0) continue;
        // Through disparity, in which the error is normal.
        const double error = 458.0 * 0.1 / (mm * 1e-3) - 458.0 * 0.1 / z;
        sum += error;
        squares += error * error;
        ++count;
      }
    REQUIRE(count == 4 * kPixels);
    // Independent nodes: 4 * 76800 / 16, known to 1 / sqrt(2 n) = 0.5 %; millimetres at 2 m add
    // 0.3 mm or 0.003 px.
    CHECK(std::sqrt(squares / count) == Approx(sigma_d).epsilon(0.03));
    CHECK(std::abs(sum / count) < 0.006);
  }
}

TEST_CASE("Depth outside the range and of the sky is a hole", "[motion]") {
  DepthSensorOptions options;
  const DepthSensor sensor(options);
  for (const double z : {0.0, 0.2, 25.0, 1000.0})
    for (const std::uint16_t mm : sensor.measure(plane(z), kWidth, kHeight, 1)) CHECK(mm == 0);
}

TEST_CASE("A nearer box leaves a shadow of its disparity on its left", "[motion]") {
  DepthSensorOptions options;
  options.disparity_noise_px = options.disparity_step_px = options.edge_loss = 0.0;
  const DepthSensor sensor(options);
  std::vector<float> depth = plane(8.0);  // d = 5.7 px
  for (int y = 80; y < 160; ++y)
    for (int x = 120; x < 200; ++x)
      depth[static_cast<std::size_t>(y * kWidth + x)] = 2.0F;  // 22.9 px
  const auto measured = sensor.measure(depth, kWidth, kHeight, 1);
  const auto at = [&](int x, int y) { return measured[static_cast<std::size_t>(y * kWidth + x)]; };
  // Pixels x with x - 5.7 > 120 - 22.9 and left of the box: 103.2 to 119.
  CHECK(at(102, 120) == 8000);
  for (int x = 105; x < 120; ++x) CHECK(at(x, 120) == 0);
  CHECK(at(120, 120) == 2000);
  CHECK(at(199, 120) == 2000);
  CHECK(at(200, 120) == 8000);
  CHECK(at(110, 79) == 8000);
}

TEST_CASE("At edges some pixels are lost, elsewhere none", "[motion]") {
  DepthSensorOptions options;
  const DepthSensor sensor(options);
  std::vector<float> depth = plane(8.0);
  for (int y = 120; y < kHeight; ++y)  // a horizontal edge: nothing is blocked
    for (int x = 0; x < kWidth; ++x) depth[static_cast<std::size_t>(y * kWidth + x)] = 2.0F;
  const auto measured = sensor.measure(depth, kWidth, kHeight, 1);
  int lost_at_edge = 0;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const bool lost = measured[static_cast<std::size_t>(y * kWidth + x)] == 0;
      if (y == 119 || y == 120)
        lost_at_edge += lost;
      else
        CHECK_FALSE(lost);
    }
  // Half of 640: 6 standard deviations of 12.6.
  CHECK(std::abs(lost_at_edge - 320) < 76);
}

TEST_CASE("Equal seeds give equal depth images, other seeds others", "[motion]") {
  const DepthSensor sensor(DepthSensorOptions{});
  const auto a = sensor.measure(plane(5.0), kWidth, kHeight, 4);
  CHECK(a == sensor.measure(plane(5.0), kWidth, kHeight, 4));
  CHECK(a != sensor.measure(plane(5.0), kWidth, kHeight, 5));
}

TEST_CASE("The depth sensor refuses options and sizes without sense", "[motion]") {
  const auto refused = [](auto change) {
    DepthSensorOptions options;
    change(options);
    CHECK_THROWS_AS(DepthSensor(options), ConfigError);
  };
  refused([](DepthSensorOptions& o) { o.focal_px = 0.0; });
  refused([](DepthSensorOptions& o) { o.baseline_m = -0.1; });
  refused([](DepthSensorOptions& o) { o.disparity_noise_px = std::nan(""); });
  refused([](DepthSensorOptions& o) { o.correlation_px = 0; });
  refused([](DepthSensorOptions& o) { o.max_range_m = 70.0; });
  refused([](DepthSensorOptions& o) { o.min_range_m = 30.0; });  // above max_range_m
  refused([](DepthSensorOptions& o) { o.edge_loss = 1.1; });
  const DepthSensor sensor(DepthSensorOptions{});
  CHECK_THROWS_AS(sensor.measure(plane(5.0), kWidth, kHeight + 1, 1), std::invalid_argument);
  CHECK_THROWS_AS(sensor.measure({}, 0, 0, 1), std::invalid_argument);
}

constexpr Stamp kFlightEpoch = 1403636579763555584;

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
  const std::vector<ImuSample> samples =
      samples_of(simulate_imu(trajectory, kFlightEpoch, options));
  PredictionErrors worst;
  for (int second = 0; second + 1 <= static_cast<int>(trajectory.end_s()); ++second) {
    const Stamp from = kFlightEpoch + second * Stamp{1'000'000'000}, to = from + 1'000'000'000;
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
  // The rest is the error of the integration, which falls with the square of the sampling period.
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
  const auto samples = simulate_imu(standing(8.0, T), kFlightEpoch, options);
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
  const auto samples = simulate_imu(standing(2.0, SE3::Identity()), kFlightEpoch, options);
  REQUIRE(samples.size() >= 601);
  CHECK(samples[0].sample.stamp == kFlightEpoch);
  CHECK(samples[1].sample.stamp == kFlightEpoch + 3333333);
  CHECK(samples[2].sample.stamp == kFlightEpoch + 6666667);
  CHECK(samples[600].sample.stamp == kFlightEpoch + 2000000000);
}

TEST_CASE("White noise has the configured density", "[motion]") {
  ImuSimulation options;
  options.seed = GENERATE(1U, 2U);
  CAPTURE(options.seed);
  options.noise.gyro_random_walk = options.noise.accel_random_walk = 0.0;
  const auto samples = simulate_imu(standing(300.0, SE3::Identity()), kFlightEpoch, options);
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
      const auto samples = simulate_imu(still, kFlightEpoch, options);
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
  const auto a = simulate_imu(still, kFlightEpoch, options);
  const auto b = simulate_imu(still, kFlightEpoch, options);
  options.seed = 10;
  const auto c = simulate_imu(still, kFlightEpoch, options);
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
    CHECK_THROWS_AS(simulate_imu(still, kFlightEpoch, options), ConfigError);
  };
  refused([](ImuSimulation& o) { o.noise.rate_hz = 0.0; });
  refused([](ImuSimulation& o) { o.noise.rate_hz = std::numeric_limits<double>::quiet_NaN(); });
  refused([](ImuSimulation& o) { o.noise.gyro_noise_density = -1.0; });
  refused([](ImuSimulation& o) { o.noise.accel_random_walk = -1.0; });
  refused([](ImuSimulation& o) { o.initial_gyro_bias = -0.1; });
}

}  // namespace
}  // namespace km
