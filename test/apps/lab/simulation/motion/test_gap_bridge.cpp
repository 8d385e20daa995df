#include <catch2/catch.hpp>
#include <cmath>
#include <vector>

#include "apps/lab/simulation/motion/flight_trajectory.hpp"
#include "apps/lab/simulation/motion/gap_bridge.hpp"
#include "apps/lab/simulation/motion/imu_simulator.hpp"
#include "apps/lab/simulation/motion/recorded_trajectory.hpp"
#include "modules/core/lie.hpp"

namespace km {
namespace {

constexpr Stamp kGapEpoch = 1'520'530'308'000'000'000;
constexpr double kFrom_s = 12.0, kTo_s = 14.5;  // begin and end of the gap

// A flight with the biases of a cheap inertial sensor, its poses at 120 Hz except for a gap.
struct GapFlight {
  SplineTrajectory truth = make_flight_trajectory(
      {Eigen::Vector3d(-3, -3, 0), Eigen::Vector3d(3, 3, 3)}, {.duration_s = 30.0});
  std::vector<StampedPose> poses;
  std::vector<ImuSample> imu;

  GapFlight() {
    for (int k = 0; k < 3600; ++k) {
      const double t = k / 120.0;
      if (t > kFrom_s && t < kTo_s) continue;
      const Stamp stamp = kGapEpoch + std::llround(1e9 * t);
      poses.push_back({stamp, pose_at(stamp)});
    }
    ImuSimulation sensor;
    sensor.noise = {.gyro_noise_density = 1.6e-4,
                    .gyro_random_walk = 2.2e-5,
                    .accel_noise_density = 2.8e-3,
                    .accel_random_walk = 8.6e-4,
                    .rate_hz = 200.0};
    for (const SimulatedImu& at : simulate_imu(truth, kGapEpoch, sensor)) imu.push_back(at.sample);
  }

  [[nodiscard]] SE3 pose_at(Stamp stamp) const {
    return truth.motion(seconds_between(kGapEpoch, stamp)).T_world_body;
  }

  // The largest distance from the truth, within the gap, of a curve through the poses `some`.
  [[nodiscard]] double error_m(const std::vector<StampedPose>& some) const {
    const RecordedTrajectory curve = fit_recording(some, kGapEpoch);
    double worst = 0.0;
    for (double t = kFrom_s; t <= kTo_s; t += 0.01)
      worst = std::max(worst, (curve.trajectory.motion(t).T_world_body.translation() -
                               truth.motion(t).T_world_body.translation())
                                  .norm());
    return worst;
  }
};

TEST_CASE("A gap in a recording is bridged by the inertial samples", "[motion]") {
  const GapFlight flight;
  const BridgedPoses bridged = bridge_gaps(flight.poses, flight.imu);
  CHECK(bridged.gaps == 1);
  CHECK(bridged.open_gaps == 0);
  CHECK(bridged.longest_s == Approx(kTo_s - kFrom_s).margin(1e-6));
  CHECK(bridged.max_m < 2e-3);
  CHECK(bridged.poses.size() == flight.poses.size() + 499);
  for (std::size_t k = 1; k < bridged.poses.size(); ++k)
    REQUIRE(bridged.poses[k].stamp > bridged.poses[k - 1].stamp);
  for (const StampedPose& pose : bridged.poses) {
    const SE3 off = flight.pose_at(pose.stamp).inverse() * pose.T;
    REQUIRE(off.translation().norm() < 5e-3);
    REQUIRE(angle_of(off.linear()) < 2e-3);
  }
  const double bridged_m = flight.error_m(bridged.poses), curve_m = flight.error_m(flight.poses);
  CAPTURE(bridged_m, curve_m);
  CHECK(bridged_m < 0.25 * curve_m);
}

TEST_CASE("A gap without inertial samples stays", "[motion]") {
  GapFlight flight;
  std::erase_if(flight.imu, [](const ImuSample& sample) {
    return seconds_between(kGapEpoch, sample.stamp) > 13.0 &&
           seconds_between(kGapEpoch, sample.stamp) < 13.1;
  });
  const BridgedPoses bridged = bridge_gaps(flight.poses, flight.imu);
  CHECK(bridged.gaps == 0);
  CHECK(bridged.open_gaps == 1);
  CHECK(bridged.poses.size() == flight.poses.size());
}

}  // namespace
}  // namespace km
