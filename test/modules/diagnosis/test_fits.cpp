#include "modules/core/geometry/lie.hpp"
#include "modules/diagnosis/focal_fit.hpp"
#include "modules/diagnosis/image_rotation.hpp"
#include "modules/diagnosis/inertial_fit.hpp"
#include "modules/diagnosis/stereo_fit.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

// Like EuRoC's: cameras that look along the body's z, rotated by 90 degrees and slightly against
// each other, with different lenses.
StereoRig rig() {
  StereoRig result;
  for (Camera& camera : result.cameras) camera.width = 752, camera.height = 480;
  Camera &left = result.cameras[0], &right = result.cameras[1];
  left.fx = 458.7, left.fy = 457.3, left.cx = 367.2, left.cy = 248.4;
  right.fx = 457.6, right.fy = 456.1, right.cx = 379.999, right.cy = 255.2;
  left.lens = Lens(LensModel::kRadialTangential, {-0.28, 0.07, 0.0002, 0.00002});
  right.lens = Lens(LensModel::kRadialTangential, {-0.28, 0.07, -0.0001, -0.00004});
  left.T_body_cam = make_pose(so3_exp(Eigen::Vector3d(0.01, 0.02, 1.55)), {-0.02, -0.06, 0.01});
  right.T_body_cam = make_pose(so3_exp(Eigen::Vector3d(0.0, 0.03, 1.56)), {-0.02, 0.05, 0.01});
  return result;
}

// Points 1 to 10 m away as seen by both cameras, with noise of half a pixel.
std::vector<StereoMatches> seen_by(const StereoRig& truth, double wrong_share = 0.1,
                                   double lowest_v = 460.0) {
  std::mt19937 rng(11);
  std::uniform_real_distribution<double> u(20.0, 730.0), v(20.0, lowest_v), inverse(0.1, 1.0), any;
  std::normal_distribution<double> noise(0.0, 0.5);
  const SE3 T_right_left = truth.T_left_right().inverse();
  StereoMatches matches;
  while (matches.pairs.size() < 400) {
    const double x = u(rng), y = v(rng), rho = inverse(rng), a = noise(rng), b = noise(rng);
    const bool wrong = any(rng) < wrong_share;
    const double wrong_x = u(rng), wrong_y = v(rng);
    const auto bearing = truth.cameras[0].unproject({x, y});
    if (!bearing) continue;
    const auto right =
        truth.cameras[1].project_ray(T_right_left * Eigen::Vector3d(bearing->homogeneous() / rho));
    if (!right) continue;
    matches.pairs.push_back({{x, y},
                             wrong ? Eigen::Vector2d(wrong_x, wrong_y)
                                   : Eigen::Vector2d(*right + Eigen::Vector2d(a, b))});
  }
  return {matches};
}

}  // namespace

TEST_CASE("A fault of the pair's calibration is identified") {
  const StereoFault fault = GENERATE(StereoFault::kInvertedPair, StereoFault::kInvertedCameras,
                                     StereoFault::kInvertedLeft, StereoFault::kInvertedRight);
  CAPTURE(static_cast<int>(fault));
  auto images = seen_by(rig());
  const StereoRig wrong = undone(rig(), fault);
  CHECK(fit_of(images, wrong).inlier_ratio < 0.4);
  const StereoAlternative best = best_alternative(images, wrong);
  CHECK(best.fault == fault);
  CHECK(best.fit.inlier_ratio == Approx(fit_of(images, rig()).inlier_ratio));
  for (PixelPair& pair : images[0].pairs) std::swap(pair.a, pair.b);
  CHECK(best_alternative(images, rig()).fault == StereoFault::kSwappedImages);
}

TEST_CASE("A turned right camera is no fault of focal lengths") {
  constexpr double kTurned_rad = 0.005;  // 2.3 px; a focal length does the same to a stripe
  StereoRig turned = rig();
  turned.cameras[1].T_body_cam.rotate(Eigen::AngleAxisd(kTurned_rad, Eigen::Vector3d::UnitX()));
  const auto images = seen_by(turned, 0.1, 120.0);
  CHECK(fit_of(images, rig()).inlier_ratio < 0.6);
  CHECK(best_alternative(images, rig()).fault == StereoFault::kNone);
}

TEST_CASE("Random matches fit no calibration") {
  const StereoAlternative best = best_alternative(seen_by(rig(), 1.0), rig());
  CHECK(best.fault == StereoFault::kNone);
  CHECK(best.fit.inlier_ratio < 0.1);
  CHECK(best_alternative({}, rig()).fault == StereoFault::kNone);
  // Points that are no numbers fit no calibration either, nor any point a calibration without a
  // number.
  auto images = seen_by(rig(), 0.0);
  StereoRig no_number = rig();
  no_number.cameras[1].T_body_cam.translation().y() = std::nan("");
  CHECK(fit_of(images, no_number).inlier_ratio == 0.0);
  for (PixelPair& pair : images[0].pairs) pair.a.x() = std::nan("");
  CHECK(fit_of(images, rig()).inlier_ratio == 0.0);
}

namespace {

constexpr double kSigma = 0.3 / 460.0;  // noise of a bearing

// Points 2 to 8 m away, seen before and after a motion, p_from = R p_to + t, with noise.
std::vector<BearingStep> seen_points(const Eigen::Vector3d& rotation, const Eigen::Vector3d& t,
                                     std::size_t count, std::mt19937& rng) {
  std::uniform_real_distribution<double> across(-0.8, 0.8), up(-0.5, 0.5), depth_m(2.0, 8.0);
  std::normal_distribution<double> noise(0.0, kSigma);
  const Eigen::Matrix3d R = so3_exp(rotation);
  std::vector<BearingStep> steps;
  while (steps.size() < count) {
    const double z = depth_m(rng), x = across(rng), y = up(rng);
    const Eigen::Vector3d from = Eigen::Vector3d(x, y, 1.0) * z;
    const Eigen::Vector3d to = R.transpose() * (from - t);
    const double a = noise(rng), b = noise(rng);
    steps.push_back({from.hnormalized(), to.hnormalized() + Eigen::Vector2d(a, b)});
  }
  return steps;
}

}  // namespace

TEST_CASE("The rotation between two images is found with any translation") {
  std::mt19937 rng(GENERATE(1U, 2U, 3U));
  const Eigen::Vector3d rotation(0.03, -0.05, 0.02);
  const Eigen::Vector3d t = GENERATE(Eigen::Vector3d(0.0, 0.0, 0.0), Eigen::Vector3d(0.1, 0.0, 0.0),
                                     Eigen::Vector3d(0.0, 0.05, 0.15));
  CAPTURE(t.transpose());
  const auto found = rotation_between(seen_points(rotation, t, 150, rng), kSigma);
  REQUIRE(found);
  CHECK(found->inlier_ratio > 0.95);
  // Across the image its error is ten times that of a bearing: see the header.
  CHECK((found->rotation - rotation).norm() < 5.0 * kSigma);
}

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

TEST_CASE("Mounting and offset and scale follow from rotations of camera and gyroscope") {
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

TEST_CASE("Steps outside the samples do not count and too few steps give no fit") {
  auto steps = seen(kMounting);
  for (VisualRotation& step : steps) step.from += 60'000'000'000, step.to += 60'000'000'000;
  CHECK_FALSE(fit_inertial(steps, samples(1.0, 0.0)));
  steps = seen(kMounting);
  steps.resize(19);
  CHECK_FALSE(fit_inertial(steps, samples(1.0, 0.0)));
  CHECK_FALSE(fit_inertial(steps, {}));
}

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
  InertialFit fit{.Q = so3_exp(Eigen::Vector3d(0.01, -0.01, 0.005)) * kDriveMounting,
                  .constant = -kDriveMounting * kDriveBias + Eigen::Vector3d(0.003, 0.002, -0.002)};
  return fit;
}

}  // namespace

TEST_CASE("The focal length follows from the gyroscope's rotation") {
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

}  // namespace km
