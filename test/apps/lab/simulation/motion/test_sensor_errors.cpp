#include <catch2/catch.hpp>
#include <cmath>

#include "apps/lab/simulation/motion/default_rig.hpp"
#include "apps/lab/simulation/motion/imu_simulator.hpp"
#include "apps/lab/simulation/motion/sensor_errors.hpp"
#include "modules/core/lie.hpp"

namespace km {
namespace {

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

}  // namespace

TEST_CASE("A scale error multiplies the integrated rotation and gravity", "[motion]") {
  InertialErrorConfig config;
  config.gyro_scale = 0.01;
  config.accel_scale = 0.02;
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

TEST_CASE("Biases drift with the sensor's temperature, and the truth has their values",
          "[motion]") {
  InertialErrorConfig config;
  config.warm_gyro_rps = 0.01;
  config.warm_accel_mps2 = 0.1;
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

TEST_CASE("A clock that drifts by 20 ppm is wrong by 20 ms after 1000 s", "[motion]") {
  TimingErrorConfig config;
  config.drift_ppm = 20.0;
  config.camera_delay_s = 0.004;
  const std::uint64_t seed = GENERATE(1U, 2U, 3U, 4U);
  const Stamp later = kClockStart + nanoseconds(1000.0);
  const RobotClock clock(config, kClockStart, later, seed);
  CHECK(clock.inertial(kClockStart) == kClockStart);
  CHECK(clock.camera(kClockStart) == kClockStart + 4'000'000);
  CHECK(std::abs(clock.inertial(later) - later) == 20'000'000);
  CHECK(clock.camera(later) == clock.inertial(later) + 4'000'000);
}

TEST_CASE("The configured share of images is lost, in runs of the configured length", "[motion]") {
  const auto images = images_at_10_hz(20000);
  TimingErrorConfig config;
  config.dropped_share = 0.2;
  config.dropped_run = 4.0;
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

TEST_CASE("The calibration that a robot gets is wrong by the configured sizes", "[motion]") {
  const SensorRig truth = default_rig(RigKind::kVehicle, 376, 240);
  CalibrationErrorConfig config;
  config.focal_share = 0.005;
  config.mounting_rad = 0.0087;
  config.stereo_rad = 0.001;
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

}  // namespace km
