#include "modules/loop_closure/epipolar_matcher.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

namespace km {
namespace {

constexpr double kBaseline_m = 0.5;

// With k1 = -0.3 and no k2 the model has its fold at a bearing of 1.05: what lies further out it
// puts where nearer things are seen. Undistorted, the images reach to 1.6 at their sides.
StereoRig folding_rig() {
  StereoRig rig;
  rig.cameras[0] = {.width = 640,
                    .height = 480,
                    .fx = 200.0,
                    .fy = 200.0,
                    .cx = 319.5,
                    .cy = 239.5,
                    .distortion = {-0.3, 0.0, 0.0, 0.0}};
  rig.cameras[1] = rig.cameras[0];
  rig.cameras[1].T_body_cam.translation().x() = kBaseline_m;
  return rig;
}

// A round dot, which looks the same in a mirror, on a grey wall.
GrayImage dot_at(const Eigen::Vector2d& bearing, const PinholeCamera& camera) {
  constexpr double kRadius_px = 1.5;
  const Eigen::Vector2d centre = camera.project(bearing);
  GrayImage image{camera.width, camera.height, {}};
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) {
      const double outside_px = (Eigen::Vector2d(x, y) - centre).norm() - kRadius_px;
      const double share = std::clamp(0.5 - 0.5 * outside_px, 0.0, 1.0);
      image.pixels.push_back(static_cast<std::uint8_t>(std::lround(60.0 + 160.0 * share)));
    }
  return image;
}

// What the matcher finds of a dot at `left` that has an inverse depth of `truth` [1/m].
float found(const StereoRig& rig, const Eigen::Vector2d& left, double truth) {
  const EpipolarMatcher matcher(rig, {.min_depth_m = 0.5, .max_depth_m = 10.0});
  StereoFrame frame;
  frame.left = dot_at(left, rig.cameras[0]);
  frame.right = dot_at(left - Eigen::Vector2d(kBaseline_m * truth, 0.0), rig.cameras[1]);
  const Eigen::Vector2f bearing = left.cast<float>();
  return matcher.inverse_depths(frame, {&bearing, 1}).front();
}

TEST_CASE("Folded distortion shows nothing twice to the epipolar matcher", "[loop_closure]") {
  const double x = GENERATE(-0.9, -0.8, -0.7);
  CAPTURE(x);
  const StereoRig rig = folding_rig();
  CHECK(found(rig, {x, 0.0}, 0.0) == 0.0F);  // at infinity, farther than is asked for
}

TEST_CASE("Inside the fold of its distortion a lens gives depth", "[loop_closure]") {
  const double x = GENERATE(-0.6, -0.4, 0.0, 0.5);
  CAPTURE(x);
  CHECK(found(folding_rig(), {x, 0.1}, 0.25) == Approx(0.25).epsilon(0.02));
}

}  // namespace
}  // namespace km
