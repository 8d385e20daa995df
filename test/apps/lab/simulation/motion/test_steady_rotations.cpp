#include <catch2/catch.hpp>
#include <cmath>
#include <random>
#include <vector>

#include "apps/lab/simulation/motion/flight_trajectory.hpp"
#include "apps/lab/simulation/motion/imu_simulator.hpp"
#include "apps/lab/simulation/motion/steady_rotations.hpp"
#include "modules/core/lie.hpp"

namespace km {
namespace {

constexpr Stamp kTurnEpoch = 1'520'530'308'000'000'000;

// A flight with a constant gyroscope bias, and its poses at 120 Hz.
struct Flight {
  SplineTrajectory motion = make_flight_trajectory(
      {Eigen::Vector3d(-3, -3, 0), Eigen::Vector3d(3, 3, 3)}, {.duration_s = 20.0});
  std::vector<StampedPose> truth;
  std::vector<ImuSample> imu;

  explicit Flight(const Eigen::Vector3d& gyro_bias) {
    for (int k = 0; k < 2400; ++k) {
      const Stamp stamp = kTurnEpoch + std::llround(1e9 * k / 120.0);
      truth.push_back({stamp, motion.motion(seconds_between(kTurnEpoch, stamp)).T_world_body});
    }
    ImuSimulation sensor;
    sensor.initial_gyro_bias = 0.0;
    sensor.noise = {.gyro_noise_density = 1.6e-4,
                    .gyro_random_walk = 2.2e-5,
                    .accel_noise_density = 2.8e-3,
                    .accel_random_walk = 8.6e-4,
                    .rate_hz = 200.0};
    for (const SimulatedImu& at : simulate_imu(motion, kTurnEpoch, sensor)) {
      imu.push_back(at.sample);
      imu.back().gyro += gyro_bias;
    }
  }

  // Rotations with noise; every hundredth is an outlier.
  [[nodiscard]] std::vector<StampedPose> trembling(double noise_rad) const {
    std::mt19937 rng(7);
    std::normal_distribution<double> normal(0.0, noise_rad);
    std::vector<StampedPose> poses = truth;
    for (std::size_t k = 0; k < poses.size(); ++k) {
      const double times = k % 100 == 50 ? 30.0 : 1.0;
      const Eigen::Vector3d turn(normal(rng), normal(rng), normal(rng));
      poses[k].T.linear() = poses[k].T.linear() * so3_exp(times * turn);
    }
    return poses;
  }

  [[nodiscard]] double rms_rad(const std::vector<StampedPose>& poses) const {
    double squares = 0.0;
    for (std::size_t k = 0; k < truth.size(); ++k) {
      const double angle = angle_of(truth[k].T.linear().transpose() * poses[k].T.linear());
      squares += angle * angle;
    }
    return std::sqrt(squares / static_cast<double>(truth.size()));
  }
};

TEST_CASE("Rotations that tremble are steadied by the gyroscope", "[motion]") {
  const Eigen::Vector3d bias(0.01, -0.02, 0.005);
  const Flight flight(bias);
  const SteadiedPoses steadied = steady_rotations(flight.trembling(1.5e-3), flight.imu);
  CHECK((steadied.gyro_bias_radps - bias).norm() < 1e-3);
  CHECK(flight.rms_rad(flight.trembling(1.5e-3)) > 2.5e-3);
  CHECK(flight.rms_rad(steadied.poses) < 1e-3);
  CHECK(steadied.max_rad > 0.03);  // outliers have no influence
  REQUIRE(steadied.poses.size() == flight.truth.size());
  for (std::size_t k = 0; k < flight.truth.size(); ++k) {
    REQUIRE(steadied.poses[k].stamp == flight.truth[k].stamp);
    REQUIRE(steadied.poses[k].T.translation() == flight.truth[k].T.translation());
  }
}

TEST_CASE("Rotations that are steady stay as they are", "[motion]") {
  const Flight flight(Eigen::Vector3d::Zero());
  const SteadiedPoses steadied = steady_rotations(flight.truth, flight.imu);
  CHECK(steadied.rms_rad < 4e-4);  // as far as the gyroscope drifts
  CHECK(flight.rms_rad(steadied.poses) == Approx(steadied.rms_rad));
}

TEST_CASE("Rotations stay as they are without inertial samples", "[motion]") {
  Flight flight(Eigen::Vector3d::Zero());
  const auto is_missing = [](Stamp stamp) {
    const double t_s = seconds_between(kTurnEpoch, stamp);
    return t_s > 5.0 && t_s < 8.0;
  };
  std::erase_if(flight.imu, [&](const ImuSample& sample) { return is_missing(sample.stamp); });
  const std::vector<StampedPose> given = flight.trembling(1.5e-3);
  const SteadiedPoses steadied = steady_rotations(given, flight.imu);
  for (std::size_t k = 0; k < given.size(); ++k)
    if (is_missing(given[k].stamp - 10'000'000) && is_missing(given[k].stamp + 10'000'000))
      REQUIRE((given[k].T.linear() - steadied.poses[k].T.linear()).norm() < 1e-12);
  CHECK(steady_rotations(given, {}).rms_rad == 0.0);
  CHECK(steady_rotations({}, flight.imu).poses.empty());
}

}  // namespace
}  // namespace km
