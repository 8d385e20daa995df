#include <catch2/catch.hpp>

#include <cmath>
#include <random>
#include <vector>

#include "modules/core/lie.hpp"
#include "modules/diagnosis/inertial_fit.hpp"

namespace km {
namespace {

constexpr Stamp kStart = 1'000'000'000;
constexpr double kNoise_rad = 3e-4;

// Rate of a camera that a hand turns about all axes [rad/s].
Eigen::Vector3d rate_at(double t_s) {
  return {0.4 * std::sin(2.1 * t_s), 0.3 * std::sin(3.3 * t_s + 1.0), 0.2 * std::cos(1.7 * t_s)};
}

// Samples of a gyroscope with that scale, a bias, and a clock that is `late_s` ahead of the
// images'.
std::vector<ImuSample> samples(double scale, double late_s) {
  std::vector<ImuSample> result;
  for (int k = 0; k < 2400; ++k) {
    const double t_s = 0.005 * k;
    result.push_back({.stamp = kStart + nanoseconds(t_s + late_s),
                      .gyro = scale * (rate_at(t_s) + Eigen::Vector3d(0.05, -0.02, 0.08))});
  }
  return result;
}

// Rotations that a camera mounted with R_cam_body sees, in steps of 0.1 s.
std::vector<VisualRotation> seen(const Eigen::Matrix3d& R_cam_body) {
  std::mt19937 rng(3);
  std::normal_distribution<double> noise(0.0, kNoise_rad);
  std::vector<VisualRotation> result;
  for (int step = 5; step < 114; ++step) {
    const double t_s = 0.1 * step;
    Eigen::Vector3d turned = Eigen::Vector3d::Zero();
    for (int k = 0; k < 100; ++k) turned += 0.001 * rate_at(t_s + 0.001 * (k + 0.5));
    Eigen::Vector3d rotation = R_cam_body * turned;
    for (double& value : rotation) value += noise(rng);
    result.push_back({kStart + nanoseconds(t_s), kStart + nanoseconds(t_s + 0.1), rotation});
  }
  return result;
}

const Eigen::Matrix3d kMounting = so3_exp(Eigen::Vector3d(0.3, -1.4, 0.6));

double degrees_between(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b) {
  return kDegrees * so3_log(a.transpose() * b).norm();
}

}  // namespace

TEST_CASE("Mounting and offset and scale follow from rotations of camera and gyroscope",
          "[diagnosis]") {
  const double scale = GENERATE(1.0, 57.2958), late_s = GENERATE(0.0, 0.0203, -0.0467);
  CAPTURE(scale, late_s);
  const auto fit = fit_inertial(seen(kMounting), samples(scale, late_s));
  REQUIRE(fit);
  CHECK(fit->explained > 0.99);
  CHECK(fit->scale * scale == Approx(1.0).margin(0.005));
  CHECK_FALSE(fit->offset_at_limit);
  CHECK(fit->offset_s == Approx(late_s).margin(5e-4));
  CHECK(std::abs(fit->offset_s - late_s) < 5.0 * fit->offset_sigma_s);
  CHECK(fit->offset_sigma_s < 1e-3);
  CHECK(degrees_between(fit->Q, kMounting) < 0.3);
  const Eigen::Vector3d bias(0.05, -0.02, 0.08);
  CHECK((fit->constant + kMounting * bias).norm() < 2e-3);
}

TEST_CASE("A mirrored axis is distinguished from any mounting", "[diagnosis]") {
  const Eigen::Matrix3d mirrored = kMounting * Eigen::Vector3d(1.0, -1.0, 1.0).asDiagonal();
  const auto fit = fit_inertial(seen(mirrored), samples(1.0, 0.0));
  REQUIRE(fit);
  CHECK(fit->Q.determinant() == Approx(-1.0));
  CHECK(fit->mirror_gain > 0.05);
  CHECK((fit->Q - mirrored).norm() < 0.01);
  CHECK(fit_inertial(seen(kMounting), samples(1.0, 0.0))->mirror_gain == 0.0);
}

TEST_CASE("Rotations unrelated to the gyroscope are not explained", "[diagnosis]") {
  auto others = samples(1.0, 0.0);
  for (std::size_t k = 0; k < others.size(); ++k) {
    const double t_s = 0.005 * static_cast<double>(k);
    others[k].gyro = {std::sin(5.0 * t_s), std::cos(4.3 * t_s), std::sin(7.0 * t_s + 2.0)};
  }
  const auto fit = fit_inertial(seen(kMounting), others);
  REQUIRE(fit);
  CHECK(fit->explained < 0.3);
}

TEST_CASE("Steps outside the samples do not count and too few steps give no fit", "[diagnosis]") {
  auto steps = seen(kMounting);
  for (VisualRotation& step : steps) step.from += 60'000'000'000, step.to += 60'000'000'000;
  CHECK_FALSE(fit_inertial(steps, samples(1.0, 0.0)));
  steps = seen(kMounting);
  steps.resize(19);
  CHECK_FALSE(fit_inertial(steps, samples(1.0, 0.0)));
  CHECK_FALSE(fit_inertial(steps, {}));
}

}  // namespace km
