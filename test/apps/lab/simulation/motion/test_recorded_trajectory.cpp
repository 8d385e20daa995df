#include <catch2/catch.hpp>

#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <stdexcept>
#include <string>
#include <vector>

#include "apps/lab/simulation/motion/flight_trajectory.hpp"
#include "apps/lab/simulation/motion/recorded_trajectory.hpp"
#include "apps/lab/simulation/world/seeded_random.hpp"
#include "modules/core/frame.hpp"
#include "modules/core/lie.hpp"
#include "modules/core/text_rows.hpp"
#include "modules/evaluation/trajectory_file.hpp"
#include "test/support/shared_data.hpp"

namespace km {
namespace {

constexpr Stamp kEpoch = 1403715273262142976;

// A flight, recorded.
struct Recording {
  SplineTrajectory truth;
  std::vector<StampedPose> poses;
};

Recording record(double rate_hz, double position_noise_m, double rotation_noise_rad) {
  FlightOptions options;
  options.duration_s = 30.0;
  Recording recording{
      make_flight_trajectory({Eigen::Vector3d(-3, -3, 0), Eigen::Vector3d(3, 3, 3)}, options), {}};
  GaussianRandom random{SeededRandom(6)};
  for (int k = 0; k <= static_cast<int>(30.0 * rate_hz); ++k) {
    const Stamp since = std::llround(k * 1e9 / rate_hz);
    SE3 T = recording.truth.motion(std::min(30.0, 1e-9 * static_cast<double>(since))).T_world_body;
    T.translation() += position_noise_m * random.draw3();
    T.linear() = T.linear() * so3_exp(rotation_noise_rad * random.draw3());
    recording.poses.push_back({kEpoch + since, T});
  }
  return recording;
}

TEST_CASE("A fit to perfect poses is the motion they were taken from", "[motion]") {
  const double rate_hz = GENERATE(20.0, 200.0);
  CAPTURE(rate_hz);
  const Recording recording = record(rate_hz, 0.0, 0.0);
  const RecordedTrajectory fitted = fit_recording(recording.poses, kEpoch);
  CHECK(fitted.epoch == kEpoch);
  CHECK(fitted.trajectory.start_s() == 0.0);
  CHECK(fitted.trajectory.end_s() == Approx(30.0));
  CHECK(fitted.deviation.position_max_m < 5e-4);
  CHECK(fitted.deviation.rotation_max_rad < 5e-4);
  for (double t = 0.2; t <= 29.8; t += 0.0173) {
    const BodyMotion truth = recording.truth.motion(t), found = fitted.trajectory.motion(t);
    CHECK((truth.T_world_body.translation() - found.T_world_body.translation()).norm() < 5e-4);
    CHECK(angle_of(truth.T_world_body.linear().transpose() * found.T_world_body.linear()) < 1e-3);
    CHECK((truth.velocity_world - found.velocity_world).norm() < 5e-3);
    CHECK((truth.angular_velocity_body - found.angular_velocity_body).norm() < 2e-2);
  }
}

TEST_CASE("A fit smooths jitter", "[motion]") {
  const Recording recording = record(200.0, 0.0005, 0.0005);
  const RecordedTrajectory fitted = fit_recording(recording.poses, kEpoch);
  double error = 0.0;
  int count = 0;
  for (const StampedPose& pose : recording.poses) {
    const double t = std::min(fitted.trajectory.end_s(), seconds_between(kEpoch, pose.stamp));
    error += (fitted.trajectory.motion(t).T_world_body.translation() -
              recording.truth.motion(t).T_world_body.translation())
                 .squaredNorm();
    ++count;
  }
  CHECK(std::sqrt(error / count) < 0.6 * 0.0005 * std::sqrt(3.0));
}

TEST_CASE("Outliers do not bend a fit", "[motion]") {
  Recording recording = record(200.0, 0.0002, 0.0002);
  for (std::size_t k = 500; k < recording.poses.size(); k += 700) {
    recording.poses[k].T.translation() += Eigen::Vector3d(0.3, -0.2, 0.1);
    recording.poses[k].T.linear() = recording.poses[k].T.linear() * so3_exp({0.0, 0.2, 0.1});
  }
  const RecordedTrajectory fitted = fit_recording(recording.poses, kEpoch);
  for (double t = 0.5; t < 29.5; t += 0.01) {
    const SE3 error =
        recording.truth.motion(t).T_world_body.inverse() * fitted.trajectory.motion(t).T_world_body;
    CHECK(error.translation().norm() < 2e-3);
    CHECK(angle_of(error.linear()) < 2e-3);
  }
}

TEST_CASE("A fit bridges gaps of the recording", "[motion]") {
  Recording recording = record(200.0, 0.0002, 0.0002);
  recording.poses.erase(recording.poses.begin() + 2000, recording.poses.begin() + 2060);  // 0.3 s
  const RecordedTrajectory fitted = fit_recording(recording.poses, kEpoch);
  for (double t = 10.0; t < 10.3; t += 0.01) {
    const SE3 error =
        recording.truth.motion(t).T_world_body.inverse() * fitted.trajectory.motion(t).T_world_body;
    CHECK(error.translation().norm() < 0.02);
    CHECK(angle_of(error.linear()) < 0.05);
  }
}

TEST_CASE("A fit's time counts from its epoch", "[motion]") {
  const Recording recording = record(20.0, 0.0, 0.0);
  const RecordedTrajectory fitted = fit_recording(recording.poses, kEpoch - 5'000'000'000);
  CHECK(fitted.trajectory.start_s() == Approx(5.0));
  CHECK(fitted.trajectory.end_s() == Approx(35.0));
}

TEST_CASE("A fit refuses poses without order and options without sense", "[motion]") {
  const std::vector<StampedPose> good = record(20.0, 0.0, 0.0).poses;
  CHECK_THROWS_AS(fit_recording({}, kEpoch), std::invalid_argument);
  CHECK_THROWS_AS(fit_recording(std::vector<StampedPose>{good[0]}, kEpoch), std::invalid_argument);
  std::vector<StampedPose> bad = good;
  std::swap(bad[3], bad[4]);
  CHECK_THROWS_AS(fit_recording(bad, kEpoch), std::invalid_argument);
  bad = good;
  bad[4].stamp = bad[3].stamp;
  CHECK_THROWS_AS(fit_recording(bad, kEpoch), std::invalid_argument);
  RecordingOptions options;
  options.interval_s = 0.0;
  CHECK_THROWS_AS(fit_recording(good, kEpoch, options), ConfigError);
  options = {};
  options.jerk_mps3 = -1.0;
  CHECK_THROWS_AS(fit_recording(good, kEpoch, options), ConfigError);
}

std::vector<ImuSample> read_gyro(const std::filesystem::path& file) {
  std::ifstream stream(file);
  const std::string text(std::istreambuf_iterator<char>(stream), {});
  std::vector<ImuSample> rows;
  for (const TextRow& row : split_rows(text)) {  // t[ns], gyro x y z, ...
    ImuSample& sample = rows.emplace_back();
    sample.stamp = parse_int64(row.fields.at(0)).value();
    for (std::size_t k = 0; k < 3; ++k)
      sample.gyro[static_cast<Eigen::Index>(k)] = parse_double(row.fields.at(k + 1)).value();
  }
  return rows;
}

// Root mean square difference of recorded and fitted angular rate, with the bias taken out.
double gyro_rms(const std::vector<ImuSample>& rows, const RecordedTrajectory& fitted) {
  const SplineTrajectory& trajectory = fitted.trajectory;
  std::vector<Eigen::Vector3d> errors;
  for (const ImuSample& row : rows) {
    const double t = seconds_between(fitted.epoch, row.stamp);
    if (t < trajectory.start_s() || t > trajectory.end_s()) continue;
    errors.push_back(row.gyro - trajectory.motion(t).angular_velocity_body);
  }
  Eigen::Vector3d bias = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& e : errors) bias += e / static_cast<double>(errors.size());
  double sum = 0.0;
  for (const Eigen::Vector3d& e : errors) sum += (e - bias).squaredNorm();
  return std::sqrt(sum / (3.0 * static_cast<double>(errors.size())));
}

TEST_CASE("The fit to V1_01's truth passes within 1 mm and 0.1 degrees of its poses", "[motion]") {
  const auto mav0 = shared_data("euroc/V1_01_easy/mav0");
  if (!mav0) return;
  const auto poses = read_trajectory(*mav0 / "state_groundtruth_estimate0/data.csv");
  const RecordedTrajectory fitted = fit_recording(poses, poses.front().stamp);
  const FitDeviation& d = fitted.deviation;
  CAPTURE(d.position_rms_m, d.position_max_m, d.rotation_rms_rad, d.rotation_max_rad);
  CHECK(d.position_max_m < 1e-3);
  CHECK(d.rotation_max_rad < 0.1 * M_PI / 180.0);

  const double rms = gyro_rms(read_gyro(*mav0 / "imu0/data.csv"), fitted);
  CAPTURE(rms);
  CHECK(rms < 0.1);  // [rad/s]
  std::cout << "V1_01: position rms " << 1e3 * d.position_rms_m << " max " << 1e3 * d.position_max_m
            << " mm, rotation rms " << d.rotation_rms_rad * 180.0 / M_PI << " max "
            << d.rotation_max_rad * 180.0 / M_PI << " deg, gyro rms " << rms << " rad/s\n";
}

}  // namespace
}  // namespace km
