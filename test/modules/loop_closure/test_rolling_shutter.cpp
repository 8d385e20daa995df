#include <catch2/catch.hpp>

#include <random>

#include "modules/core/lie.hpp"
#include "modules/loop_closure/keyframe_features.hpp"
#include "test/support/random_pose.hpp"

namespace km {
namespace {

Camera camera_of(const SE3& T_body_cam) {
  Camera camera{.width = 752, .height = 480, .fx = 458.0, .fy = 458.0, .cx = 376.0, .cy = 240.0};
  camera.T_body_cam = T_body_cam;
  return camera;
}

// Pose of the body `late_s` after the identity, with a constant twist in the body frame.
SE3 moved(const Vector6& twist_body, double late_s) {
  return se3_exp(late_s * twist_body);
}

}  // namespace

TEST_CASE("Points of a rolling shutter are where a global shutter sees them",
          "[loop_closure][rolling_shutter]") {
  constexpr double kReadout_s = 0.0015;  // so short that terms of second order are small
  std::mt19937 rng(GENERATE(range(0U, 4U)));
  const SE3 T_body_cam = random_pose(rng);
  const Camera camera = camera_of(T_body_cam);
  Vector6 twist_body;
  twist_body << random_vector<3>(rng), 2.0 * random_vector<3>(rng);
  KeyframeFeatures features, expected;
  features.T_body_cam = T_body_cam;
  for (int i = 0; i < 50; ++i) {
    const Eigen::Vector2d seen = 0.3 * random_vector<2>(rng);
    const double late_s = kReadout_s * camera.row_time(camera.project(seen)->y());
    // A point that stands still, at a depth of 4 m when its row is exposed.
    const Eigen::Vector3d p_body =
        moved(twist_body, late_s) * (T_body_cam * (4.0 * seen.homogeneous()));
    const Eigen::Vector3d p_cam = T_body_cam.inverse() * p_body;
    features.keypoints.push_back({.bearing = seen.cast<float>(), .inverse_depth = 0.25F});
    expected.keypoints.push_back({.bearing = p_cam.hnormalized().cast<float>(),
                                  .inverse_depth = static_cast<float>(1.0 / p_cam.z())});
  }
  const KeyframeFeatures rolled = features;
  unroll(camera, kReadout_s, twist_body, features);
  double largest = 0.0;
  for (std::size_t i = 0; i < features.keypoints.size(); ++i) {
    const Keypoint& is = features.keypoints[i];
    const Keypoint& due = expected.keypoints[i];
    largest = std::max<double>(largest, (rolled.keypoints[i].bearing - due.bearing).norm());
    CHECK((is.bearing - due.bearing).norm() < 3e-5F);
    CHECK(is.inverse_depth == Approx(due.inverse_depth).epsilon(1e-4));
  }
  CHECK(largest > 5e-4);
}

TEST_CASE("A global shutter's points, and those of a camera at rest, do not move",
          "[loop_closure][rolling_shutter]") {
  std::mt19937 rng(7);
  KeyframeFeatures features;
  features.keypoints = {{.bearing = {0.1F, -0.2F}, .inverse_depth = 0.5F}};
  const auto [readout_s, speed] = GENERATE(table<double, double>({{0.0, 1.0}, {0.03, 0.0}}));
  unroll(camera_of(SE3::Identity()), readout_s, speed * random_vector<6>(rng), features);
  CHECK(features.keypoints[0].bearing == Eigen::Vector2f(0.1F, -0.2F));
  CHECK(features.keypoints[0].inverse_depth == 0.5F);
}

}  // namespace km
