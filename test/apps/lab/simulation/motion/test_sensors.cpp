#include "apps/lab/simulation/motion/default_rig.hpp"
#include "apps/lab/simulation/motion/depth_sensor.hpp"
#include "apps/lab/simulation/motion/flight_trajectory.hpp"
#include "apps/lab/simulation/motion/imu_simulator.hpp"
#include "apps/lab/simulation/motion/sensor_errors.hpp"
#include "apps/lab/simulation/motion/vehicle_trajectory.hpp"
#include "modules/core/geometry/lie.hpp"
#include "modules/vio/preintegration.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

constexpr int kWidth = 320, kHeight = 240;
constexpr std::size_t kPixels = 320 * 240;

std::vector<float> plane(double z_m) {
  return std::vector<float>(kPixels, static_cast<float>(z_m));
}

TEST_CASE("The error of depth grows with the square of range") {
  // Rounding to steps of 1/16 px adds the variance of a uniform distribution; noise hides the
  // steps.
  const double sigma_d = std::sqrt(0.15 * 0.15 + 1.0 / (16.0 * 16.0 * 12.0));
  for (const double z : {2.0, 4.0, 8.0}) {
    CAPTURE(z);
    double sum = 0.0, squares = 0.0;
    int count = 0;
    for (std::uint64_t seed = 0; seed < 4; ++seed)
      for (const std::uint16_t mm : measured_depth(plane(z), kWidth, kHeight, seed, {})) {
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
  for (const double z : {0.0, 0.2, 25.0, 1000.0})  // the sky, or out of range
    for (const std::uint16_t mm : measured_depth(plane(z), kWidth, kHeight, 1, {})) CHECK(mm == 0);
}

TEST_CASE("A nearer box leaves a shadow of its disparity on its left") {
  std::vector<float> depth = plane(8.0);  // d = 5.7 px
  for (int y = 80; y < 160; ++y)
    for (int x = 120; x < 200; ++x)
      depth[static_cast<std::size_t>(y * kWidth + x)] = 2.0F;  // 22.9 px
  const auto measured = measured_depth(depth, kWidth, kHeight, 1, {});
  const auto at = [&](int x, int y) { return measured[static_cast<std::size_t>(y * kWidth + x)]; };
  // Pixels x with x - 5.7 > 120 - 22.9 and left of the box: 103.2 to 119.
  constexpr int kNear_mm = 100, kFar_mm = 1500;  // six standard deviations
  CHECK(at(102, 120) == Approx(8000).margin(kFar_mm));
  for (int x = 105; x < 119; ++x) CHECK(at(x, 120) == 0);
  CHECK(at(122, 120) == Approx(2000).margin(kNear_mm));
  CHECK(at(197, 120) == Approx(2000).margin(kNear_mm));
  CHECK(at(202, 120) == Approx(8000).margin(kFar_mm));
  CHECK(at(110, 77) == Approx(8000).margin(kFar_mm));
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
  options.noise = {.gyro_noise_density = 0.0,
                   .gyro_random_walk = 0.0,
                   .accel_noise_density = 0.0,
                   .accel_random_walk = 0.0,
                   .rate_hz = rate_hz};
  options.initial_gyro_bias = options.initial_accel_bias = 0.0;
  const std::vector<ImuSample> samples =
      samples_of(simulate_imu(trajectory, kFlightEpoch, options));
  PredictionErrors worst;
  for (int second = 0; second + 1 <= static_cast<int>(trajectory.end_s()); ++second) {
    const Stamp from = kFlightEpoch + second * Stamp{1'000'000'000}, to = from + 1'000'000'000;
    ImuPreintegration imu(ImuNoise{}, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero());
    REQUIRE(imu.add(samples, from, to));
    const BodyMotion begin = trajectory.motion(second), end = trajectory.motion(second + 1.0);
    OdometryState state{.T_odom_body = begin.T_world_body, .v_odom = begin.velocity_world};
    const OdometryState reached = predict(state, imu, 9.81);
    worst.rotation = std::max(worst.rotation, angle_of(end.T_world_body.linear().transpose() *
                                                       reached.T_odom_body.linear()));
    worst.velocity = std::max(worst.velocity, (end.velocity_world - reached.v_odom).norm());
    worst.position =
        std::max(worst.position,
                 (end.T_world_body.translation() - reached.T_odom_body.translation()).norm());
  }
  return worst;
}

TEST_CASE("Preintegrated noise-free samples of a flight reproduce it") {
  FlightOptions options{.duration_s = 20.0};
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

TEST_CASE("White noise has the configured density") {
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

constexpr Stamp kClockStart = 1'000'000'000'000;

// A body at the origin that turns about its z axis, which stays upright.
class Turntable final : public BodyTrajectory {
 public:
  Turntable(double rate_rps, double end_s) : rate_rps_(rate_rps), end_s_(end_s) {}
  [[nodiscard]] double start_s() const override { return 0.0; }
  [[nodiscard]] double end_s() const override { return end_s_; }
  [[nodiscard]] BodyMotion motion(double t_s) const override {
    BodyMotion motion;
    motion.T_world_body = make_pose(so3_exp({0.0, 0.0, rate_rps_ * t_s}), {0.0, 0.0, 0.0});
    motion.angular_velocity_body = {0.0, 0.0, rate_rps_};
    return motion;
  }

 private:
  double rate_rps_, end_s_;
};

ImuSimulation ideal_with(const InertialErrors& errors) {
  ImuSimulation options;
  options.noise.gyro_noise_density = options.noise.gyro_random_walk = 0.0;
  options.noise.accel_noise_density = options.noise.accel_random_walk = 0.0;
  options.initial_gyro_bias = options.initial_accel_bias = 0.0;
  options.errors = errors;
  return options;
}

std::vector<Stamp> images_at_10_hz(std::size_t count) {
  std::vector<Stamp> images;
  for (std::size_t i = 0; i < count; ++i)
    images.push_back(kClockStart + static_cast<Stamp>(i) * 100'000'000);
  return images;
}

TEST_CASE("A scale error multiplies the integrated rotation and gravity") {
  InertialErrorConfig config{.gyro_scale = 0.01, .accel_scale = 0.02};
  const std::uint64_t seed = GENERATE(1U, 2U, 3U);
  CAPTURE(seed);
  const InertialErrors errors = draw_inertial_errors(config, seed);
  const double sign_gyro = errors.gyro_matrix(2, 2) > 1.0 ? 1.0 : -1.0;
  const double sign_accel = errors.accel_matrix(2, 2) > 1.0 ? 1.0 : -1.0;
  const auto samples = simulate_imu(Turntable(0.5, 10.0), kClockStart, ideal_with(errors));
  double angle_rad = 0.0;
  for (std::size_t k = 1; k < samples.size(); ++k)
    angle_rad += samples[k].sample.gyro.z() *
                 seconds_between(samples[k - 1].sample.stamp, samples[k].sample.stamp);
  CHECK(angle_rad == Approx(0.5 * 10.0 * (1.0 + sign_gyro * 0.01)).epsilon(1e-12));
  CHECK(samples.back().sample.accel.z() == Approx(9.81 * (1.0 + sign_accel * 0.02)).epsilon(1e-12));
}

TEST_CASE("Biases drift with the sensor's temperature, and the truth has their values") {
  InertialErrorConfig config{.warm_gyro_rps = 0.01, .warm_accel_mps2 = 0.1};
  const auto samples =
      simulate_imu(Turntable(0.0, 120.5), kClockStart, ideal_with(draw_inertial_errors(config, 5)));
  for (const int seconds : {0, 60, 120}) {
    CAPTURE(seconds);
    const SimulatedImu& at = samples.at(static_cast<std::size_t>(200 * seconds));
    const double warmth = 1.0 - std::exp(-seconds / 60.0);
    for (int axis = 0; axis < 3; ++axis) {
      CHECK(std::abs(at.sample.gyro[axis]) == Approx(0.01 * warmth).margin(1e-15));
      CHECK(std::abs(at.accel_bias[axis]) == Approx(0.1 * warmth).margin(1e-15));
    }
    CHECK(at.gyro_bias == at.sample.gyro);
  }
}

TEST_CASE("A clock that drifts by 20 ppm is wrong by 20 ms after 1000 s") {
  TimingErrorConfig config{.drift_ppm = 20.0, .camera_delay_s = 0.004};
  const std::uint64_t seed = GENERATE(1U, 2U, 3U, 4U);
  const Stamp later = kClockStart + nanoseconds(1000.0);
  const RobotClock clock(config, kClockStart, later, seed);
  CHECK(clock.inertial(kClockStart) == kClockStart);
  CHECK(clock.camera(kClockStart) == kClockStart + 4'000'000);
  CHECK(std::abs(clock.inertial(later) - later) == 20'000'000);
  CHECK(clock.camera(later) == clock.inertial(later) + 4'000'000);
}

TEST_CASE("The configured share of images is lost, in runs of the configured length") {
  const auto images = images_at_10_hz(20000);
  TimingErrorConfig config{.dropped_share = 0.2, .dropped_run = 4.0};
  const auto kept = without_dropped(images, config, 7);
  CHECK(kept.front() == images.front());
  std::size_t runs = 0;
  for (std::size_t k = 1; k < kept.size(); ++k)
    runs += kept[k] - kept[k - 1] > 100'000'000 ? 1U : 0U;
  const double lost = static_cast<double>(images.size() - kept.size());
  // About 1000 runs. Length and interval of runs have standard deviations of about their means, so
  // the ratios are known to 1 / sqrt(1000) = 3 %; checked to 4 of these.
  CHECK(lost / 20000.0 == Approx(0.2).epsilon(0.13));
  CHECK(lost / static_cast<double>(runs) == Approx(4.0).epsilon(0.13));
  CHECK(without_dropped(images, config, 7) == kept);
  CHECK(without_dropped(images, config, 8) != kept);
  CHECK(without_dropped(images, {}, 7) == images);
}

TEST_CASE("The calibration that a robot gets is wrong by the configured sizes") {
  const SensorRig truth = default_rig(RigKind::kVehicle, 376, 240);
  CalibrationErrorConfig config{.focal_share = 0.005, .mounting_rad = 0.0087, .stereo_rad = 0.001};
  const std::uint64_t seed = GENERATE(1U, 2U, 3U);
  CAPTURE(seed);
  const SensorRig told = told_rig(truth, config, seed);
  const auto angle = [](const SE3& a, const SE3& b) {
    return so3_log(a.linear().transpose() * b.linear()).norm();
  };
  const auto& [left, right] = truth.stereo.cameras;
  const auto& [told_left, told_right] = told.stereo.cameras;
  CHECK(std::abs(told_left.fx / left.fx - 1.0) == Approx(0.005));
  CHECK(told_right.fy / right.fy == Approx(told_left.fx / left.fx));
  CHECK(angle(told_left.T_body_cam, left.T_body_cam) == Approx(0.0087));
  CHECK(angle(told.stereo.T_left_right(), truth.stereo.T_left_right()) == Approx(0.001));
  CHECK(told.stereo.baseline_m() == Approx(truth.stereo.baseline_m()));
  const SensorRig exact = told_rig(truth, {}, seed);
  CHECK(exact.stereo.cameras[0].fx == left.fx);
  CHECK(exact.stereo.cameras[1].T_body_cam.matrix() == right.T_body_cam.matrix());
}

}  // namespace
}  // namespace km
