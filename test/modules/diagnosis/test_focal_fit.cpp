#include <catch2/catch.hpp>

#include <cmath>
#include <random>
#include <vector>

#include "modules/core/lie.hpp"
#include "modules/diagnosis/focal_fit.hpp"

namespace km {
namespace {

constexpr Stamp kDriveBegin = 1'000'000'000;
constexpr double kDriveStep_s = 0.1;
constexpr int kDriveSteps = 60, kDrivePoints = 80;

const Eigen::Matrix3d kDriveMounting = so3_exp(Eigen::Vector3d(1.2, -1.2, 1.2));  // R_cam_body
const Eigen::Vector3d kDriveBias(0.03, -0.02, 0.01);

// Rate of a robot that drives and turns, about the camera's axes [rad/s].
Eigen::Vector3d driving_rate(double t_s) {
  return {0.03 * std::sin(4.0 * t_s), 0.15 * std::sin(1.3 * t_s), 0.02 * std::cos(3.0 * t_s)};
}

StereoRig driven_rig() {
  StereoRig pair;
  for (Camera& camera : pair.cameras)
    camera = {.width = 752, .height = 480, .fx = 460, .fy = 455, .cx = 370, .cy = 250};
  pair.cameras[1].T_body_cam.translation().x() = 0.11;
  return pair;
}

StereoRig scaled(StereoRig pair, double factor) {
  for (Camera& camera : pair.cameras) camera.fx *= factor, camera.fy *= factor;
  return pair;
}

// Steps that `rig` sees of points all around, with motion forward and sideways and with noise [px].
std::vector<TrackedStep> driven(double noise_px) {
  const StereoRig pair = driven_rig();
  const SE3 T_right_left = pair.T_left_right().inverse();
  std::mt19937 rng(5);
  std::normal_distribution<double> noise(0.0, noise_px);
  std::uniform_real_distribution<double> x(-0.7, 0.7), y(-0.45, 0.45), depth_m(1.5, 9.0);
  const auto noisy = [&](const Eigen::Vector2d& pixel) {
    return Eigen::Vector2d(pixel.x() + noise(rng), pixel.y() + noise(rng));
  };
  std::vector<TrackedStep> steps;
  for (int k = 1; k <= kDriveSteps; ++k) {
    const double t_s = kDriveStep_s * k;
    Eigen::Vector3d turned = Eigen::Vector3d::Zero();
    for (int i = 0; i < 100; ++i) turned += 1e-3 * driving_rate(t_s + 1e-3 * (i + 0.5));
    SE3 T_from_to = SE3::Identity();
    T_from_to.linear() = so3_exp(turned);
    T_from_to.translation() = Eigen::Vector3d(0.01 * std::sin(t_s), 0.0, 0.06);
    TrackedStep& step = steps.emplace_back();
    step.from = kDriveBegin + nanoseconds(t_s);
    step.to = kDriveBegin + nanoseconds(t_s + kDriveStep_s);
    for (int i = 0; i < kDrivePoints; ++i) {
      const Eigen::Vector3d point = depth_m(rng) * Eigen::Vector3d(x(rng), y(rng), 1.0);
      const auto from = pair.cameras[0].project_ray(point);
      const auto right = pair.cameras[1].project_ray(T_right_left * point);
      const auto to = pair.cameras[0].project_ray(T_from_to.inverse() * point);
      if (from && right && to) step.points.push_back({noisy(*from), noisy(*to), noisy(*right)});
    }
  }
  return steps;
}

std::vector<ImuSample> driven_samples() {
  std::vector<ImuSample> result;
  for (int k = 0; k < 1500; ++k) {
    const double t_s = 0.005 * k;
    result.push_back({.stamp = kDriveBegin + nanoseconds(t_s),
                      .gyro = kDriveMounting.transpose() * driving_rate(t_s) + kDriveBias});
  }
  return result;
}

// About right, like the rotations from images.
InertialFit rough_fit() {
  InertialFit fit;
  fit.Q = so3_exp(Eigen::Vector3d(0.01, -0.01, 0.005)) * kDriveMounting;
  fit.constant = -kDriveMounting * kDriveBias + Eigen::Vector3d(0.003, 0.002, -0.002);
  return fit;
}

}  // namespace

TEST_CASE("The focal length follows from the gyroscope's rotation", "[diagnosis]") {
  const double given = GENERATE(0.97, 1.0, 1.03);
  CAPTURE(given);
  const auto exact =
      fit_focal(driven(0.0), scaled(driven_rig(), given), driven_samples(), rough_fit());
  REQUIRE(exact);
  CHECK(exact->factor * given == Approx(1.0).margin(5e-4));
  CHECK(exact->steps == kDriveSteps);

  const auto noisy =
      fit_focal(driven(0.2), scaled(driven_rig(), given), driven_samples(), rough_fit());
  REQUIRE(noisy);
  CHECK(noisy->factor * given == Approx(1.0).margin(3.0 * noisy->sigma));
  CHECK(noisy->sigma < 0.01);
  CHECK(noisy->error_px == Approx(0.3).margin(0.15));
}

TEST_CASE("Without rotation a gyroscope gives no focal length", "[diagnosis]") {
  std::vector<TrackedStep> steps = driven(0.2);
  for (TrackedStep& step : steps)  // all points are far away, and the robot stands still
    for (TrackedPoint& point : step.points) point.to = point.from;
  std::vector<ImuSample> still = driven_samples();
  for (ImuSample& sample : still) sample.gyro = kDriveBias;
  const auto fit = fit_focal(steps, driven_rig(), still, rough_fit());
  CHECK((!fit || fit->sigma > 0.05));
}

}  // namespace km
