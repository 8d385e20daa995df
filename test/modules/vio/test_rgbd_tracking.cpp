#include <algorithm>
#include <catch2/catch.hpp>
#include <map>

#include "modules/core/lie.hpp"
#include "modules/vio/feature_tracker.hpp"
#include "textured_plane.hpp"

namespace km {
namespace {

constexpr Stamp kFrameNs = 50'000'000;

TrackerConfig small_image_config() {
  TrackerConfig config;
  config.max_features = 80;
  config.min_distance_px = 14;
  return config;
}

StereoRig test_rgbd_rig() {
  return rgbd_rig(test_rig().cameras[0], 0.11);
}

SE3 sideways(int frame) {
  Vector6 xi = Vector6::Zero();
  xi.tail<3>() << 0.02 * frame, 0.01 * frame, 0.0;
  return se3_exp(xi);
}

std::ptrdiff_t located(const TrackedFrame& frame) {
  return std::count_if(frame.features.begin(), frame.features.end(),
                       [](const TrackedFeature& f) { return f.right.has_value(); });
}

TEST_CASE("Depth puts features where a right camera would see them", "[vio]") {
  const StereoRig rig = test_rgbd_rig();
  const TexturedPlane plane{2.0, 0.06, 3};
  FeatureTracker tracker(rig, small_image_config());
  for (int i = 0; i < 5; ++i) {
    const TrackedFrame frame = tracker.track(plane.render_rgbd(rig, sideways(i), i * kFrameNs),
                                             Eigen::Matrix3d::Identity());
    REQUIRE(frame.features.size() > 40);
    CHECK(located(frame) == static_cast<std::ptrdiff_t>(frame.features.size()));
    CHECK(tracker.statistics().stereo.matched == static_cast<int>(frame.features.size()));
    CHECK(tracker.statistics().motion_known == (i > 0));
    for (const TrackedFeature& feature : frame.features) {
      const Eigen::Vector2d expected = feature.left - Eigen::Vector2d(0.11 / 2.0, 0.0);
      // Half a millimetre of 2 m: less than a hundredth of a pixel.
      CHECK(230.0 * (*feature.right - expected).norm() < 0.01);
    }
  }
}

TEST_CASE("Features outlive images without depth", "[vio]") {
  const StereoRig rig = test_rgbd_rig();
  const TexturedPlane plane;
  FeatureTracker tracker(rig, small_image_config());
  for (int i = 0; i < 9; ++i) {
    CAPTURE(i);
    StereoFrame frame = plane.render_rgbd(rig, sideways(i), i * kFrameNs);
    const bool with_depth = i % 4 == 0;
    if (!with_depth) frame.depth = nullptr;
    const TrackedFrame result = tracker.track(frame, Eigen::Matrix3d::Identity());
    CHECK(result.features.size() > 40);
    CHECK((located(result) > 0) == with_depth);
    // The motion carries the depth from one depth image to the next.
    if (i > 0) CHECK(tracker.statistics().motion_known);
  }
}

TEST_CASE("Holes and edges of the depth image give no right observation", "[vio]") {
  const StereoRig rig = test_rgbd_rig();
  const TexturedPlane plane;
  StereoFrame frame = plane.render_rgbd(rig, SE3::Identity(), 0);
  DepthImage depth = *frame.depth;
  const int hole_end = depth.width / 3, edge = 2 * depth.width / 3;
  for (int y = 0; y < depth.height; ++y) {
    for (int x = 0; x < depth.width; ++x) {
      std::uint16_t& z_mm = depth.millimetres[static_cast<std::size_t>(y * depth.width + x)];
      if (x < hole_end) z_mm = 0;
      if (x >= edge) z_mm = 1000;
    }
  }
  frame.depth = std::make_shared<const DepthImage>(std::move(depth));
  FeatureTracker tracker(rig, small_image_config());
  const TrackedFrame result = tracker.track(frame, Eigen::Matrix3d::Identity());
  int in_hole = 0, beyond = 0;
  for (const TrackedFeature& feature : result.features) {
    const double x = rig.cameras[0].project(feature.left).x();
    CAPTURE(x);
    if (x < hole_end - 1) {
      ++in_hole;
      CHECK_FALSE(feature.right.has_value());
    } else if (x > edge - 1 && x < edge) {
      CHECK_FALSE(feature.right.has_value());
    } else if (x >= hole_end) {
      const double z_m = x >= edge ? 1.0 : 2.0;
      beyond += x >= edge ? 1 : 0;
      REQUIRE(feature.right.has_value());
      CHECK((feature.left - *feature.right).x() == Approx(0.11 / z_m).epsilon(1e-3));
    }
  }
  CHECK(in_hole > 10);
  CHECK(beyond > 10);
}

TEST_CASE("Nearer than the nearest depth is no depth", "[vio]") {
  const StereoRig rig = test_rgbd_rig();
  TrackerConfig config = small_image_config();
  config.min_depth_m = 2.5;
  FeatureTracker tracker(rig, config);
  const TrackedFrame result =
      tracker.track(TexturedPlane{}.render_rgbd(rig, SE3::Identity(), 0), SE3::Identity().linear());
  CHECK(result.features.size() > 40);
  CHECK(located(result) == 0);
}

TEST_CASE("A depth image of the wrong size is refused and changes nothing", "[vio]") {
  const StereoRig rig = test_rgbd_rig();
  FeatureTracker tracker(rig, small_image_config());
  StereoFrame frame = TexturedPlane{}.render_rgbd(rig, SE3::Identity(), 0);
  const auto whole = frame.depth;
  DepthImage cut = *whole;
  cut.millimetres.pop_back();
  frame.depth = std::make_shared<const DepthImage>(std::move(cut));
  CHECK_THROWS_AS(tracker.track(frame, Eigen::Matrix3d::Identity()), std::invalid_argument);
  frame.depth = whole;
  const TrackedFrame result = tracker.track(frame, Eigen::Matrix3d::Identity());
  REQUIRE_FALSE(result.features.empty());
  CHECK(result.features.front().id == 0);
}

}  // namespace
}  // namespace km
