#include <catch2/catch.hpp>

#include <cmath>
#include <random>
#include <vector>

#include "modules/core/lie.hpp"
#include "modules/diagnosis/stereo_fit.hpp"

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
std::vector<StereoMatches> seen_by(const StereoRig& truth, double wrong_share = 0.1) {
  std::mt19937 rng(11);
  std::uniform_real_distribution<double> u(20.0, 730.0), v(20.0, 460.0), inverse(0.1, 1.0), any;
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

TEST_CASE("Points of a pair lie on the lines of its own calibration", "[diagnosis]") {
  const StereoFit fit = fit_of(seen_by(rig()), rig());
  CHECK(fit.points == 400);
  CHECK(fit.inlier_ratio == Approx(0.9).margin(0.05));
  CHECK(fit.error_px < 0.6);
  CHECK(fit.depth_m > 1.0);
  CHECK(fit.depth_m < 4.0);
  const StereoAlternative best = best_alternative(seen_by(rig()), rig());
  CHECK(best.fault == StereoFault::kNone);
  CHECK(best.fit.inlier_ratio == fit.inlier_ratio);
}

TEST_CASE("A fault of the pair's calibration is identified", "[diagnosis]") {
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

TEST_CASE("A focal length of one camera that is 3 % off is found with its ratio", "[diagnosis]") {
  const double ratio = GENERATE(0.97, 1.03);
  StereoRig wrong = rig();
  wrong.cameras[1].fx *= ratio;
  wrong.cameras[1].fy *= ratio;
  const StereoAlternative best = best_alternative(seen_by(rig()), wrong);
  CHECK(best.fault == StereoFault::kFocalLength);
  CHECK(best.focal_ratio * ratio == Approx(1.0).margin(0.006));
}

TEST_CASE("Random matches fit no calibration", "[diagnosis]") {
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

}  // namespace km
