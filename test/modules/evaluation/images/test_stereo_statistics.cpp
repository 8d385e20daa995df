#include "modules/evaluation/images/stereo_statistics.hpp"

#include <catch2/catch.hpp>

#include "test/modules/evaluation/images/synthetic_images.hpp"

namespace km {
namespace {

constexpr int kRigWidth = 400;
constexpr int kRigHeight = 300;
constexpr double kFocal_px = 300.0;
constexpr double kBaseline_m = 0.1;
constexpr Stamp kFirstStamp = 1'000'000'000;
const StereoRig kRig = aligned_rig(kRigWidth, kRigHeight, kFocal_px);

}  // namespace

TEST_CASE("A wall parallel to the cameras is found at its depth", "[image_statistics]") {
  const int disparity_px = GENERATE(6, 15);
  CAPTURE(disparity_px);
  const double depth_m = kFocal_px * kBaseline_m / disparity_px;
  const cv::Mat surface = texture(kRigWidth + disparity_px, kRigHeight, 11);
  const KltImage left = make_klt_image(view_of(surface, 0, 0, kRigWidth, kRigHeight));
  const KltImage right = make_klt_image(view_of(surface, disparity_px, 0, kRigWidth, kRigHeight));
  StereoStatistics statistics(kRig);
  statistics.add(kFirstStamp, left, right, corners_of(left.image));
  const auto figures = figures_of(statistics);
  // All except for the corners outside the right camera's view.
  const double seen = 1.0 - disparity_px / double{kRigWidth};
  CHECK(figure(figures, "KLT, left to right", "pass, share of corners") > seen - 0.05);
  CHECK(figure(figures, "KLT, left to right", "also within 1.5 px of the epipolar line") >
        seen - 0.05);
  CHECK(figure(figures, "KLT, left to right", "epipolar error [px] p90") < 0.05);
  CHECK(figure(figures, "KLT, left to right", "depth [m] median") == Approx(depth_m).epsilon(0.01));
  CHECK(figure(figures, "KLT, left to right", "depth [m] p5") == Approx(depth_m).epsilon(0.02));
  CHECK(figure(figures, "ORB, left to right", "matches") > 200);
  CHECK(figure(figures, "ORB, left to right", "share within 1.5 px of the epipolar line") > 0.9);
}

TEST_CASE("A right image that is too low misses the epipolar lines", "[image_statistics]") {
  const cv::Mat surface = texture(kRigWidth + 10, kRigHeight + 3, 11);
  const KltImage left = make_klt_image(view_of(surface, 0, 0, kRigWidth, kRigHeight));
  const KltImage right = make_klt_image(view_of(surface, 10, 3, kRigWidth, kRigHeight));
  StereoStatistics statistics(kRig);
  statistics.add(kFirstStamp, left, right, corners_of(left.image));
  const auto figures = figures_of(statistics);
  CHECK(figure(figures, "KLT, left to right", "pass, share of corners") > 0.9);
  CHECK(figure(figures, "KLT, left to right", "also within 1.5 px of the epipolar line") < 0.01);
  // The remaining matches come from coarse octaves, whose keypoints err by pixels.
  CHECK(figure(figures, "ORB, left to right", "share within 1.5 px of the epipolar line") < 0.2);
}

TEST_CASE("Later views are matched at their lags only", "[image_statistics]") {
  const KltImage image = make_klt_image(texture(kRigWidth, kRigHeight, 11));
  StereoStatistics statistics(kRig);
  for (const double t_s : {0.0, 0.25, 0.6})
    statistics.add(kFirstStamp + nanoseconds(t_s), image, {}, corners_of(image.image));
  const auto figures = figures_of(statistics);
  CHECK(figure(figures, "ORB, left to left", "matches, 0.25 s") > 500);
  CHECK(std::isnan(figure(figures, "ORB, left to left", "matches, 0.5 s")));
  CHECK(std::isnan(figure(figures, "ORB, left to left", "matches, 1 s")));
  CHECK(std::isnan(figure(figures, "KLT, left to right", "matches a pair")));  // no right camera
}

}  // namespace km
