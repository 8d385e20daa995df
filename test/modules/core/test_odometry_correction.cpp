#include <catch2/catch.hpp>

#include <numbers>

#include "modules/core/lie.hpp"
#include "modules/core/odometry_correction.hpp"
#include "test/support/random_pose.hpp"

namespace km {
namespace {

SE3 at(double x, double y, double yaw = 0.0) {
  return make_pose(so3_exp({0, 0, yaw}), Eigen::Vector3d(x, y, 0));
}

TEST_CASE("Odometry beyond the last optimised keyframe follows it rigidly", "[core]") {
  // In the optimised graph the body turned left while moving to (0, 1); in odometry it went
  // straight.
  const std::vector<StampedPose> odometry = {{0, at(0, 0)}, {1, at(1, 0)}, {2, at(3, 0)}};
  const std::vector<StampedPose> keyframes = {{0, at(0, 0)}, {1, at(0, 1, std::numbers::pi / 2)}};
  const auto corrected = correct_odometry(odometry, keyframes);
  REQUIRE(corrected.size() == 3);
  CHECK((corrected[1].T.matrix() - keyframes[1].T.matrix()).norm() < 1e-12);
  CHECK((corrected[2].T.translation() - Eigen::Vector3d(0, 3, 0)).norm() < 1e-12);
}

TEST_CASE("Between two keyframes the correction is interpolated in time", "[core]") {
  const std::vector<StampedPose> odometry = {{0, at(0, 0)}, {1, at(1, 0)}, {4, at(4, 0)}};
  const std::vector<StampedPose> keyframes = {{0, at(0, 0)}, {4, at(4, 2)}};
  const auto corrected = correct_odometry(odometry, keyframes);
  CHECK((corrected[1].T.translation() - Eigen::Vector3d(1, 0.5, 0)).norm() < 1e-12);
}

TEST_CASE("A rigid change of frame moves every pose rigidly", "[core]") {
  std::mt19937 rng(11);
  const SE3 T_world_odom = random_pose(rng);
  std::vector<StampedPose> odometry;
  std::vector<StampedPose> keyframes;
  for (Stamp stamp = 0; stamp < 20; ++stamp) {
    odometry.push_back({stamp, random_pose(rng)});
    if (stamp % 5 == 2) keyframes.push_back({stamp, T_world_odom * odometry.back().T});
  }
  for (const StampedPose& pose : correct_odometry(odometry, keyframes)) {
    const SE3 expected = T_world_odom * odometry[static_cast<std::size_t>(pose.stamp)].T;
    CHECK((pose.T.matrix() - expected.matrix()).norm() < 1e-9);
  }
}

TEST_CASE("Without a common instant odometry is returned unchanged", "[core]") {
  const std::vector<StampedPose> odometry = {{0, at(0, 0)}, {2, at(1, 0)}};
  const std::vector<StampedPose> keyframes = {{1, at(9, 9)}};
  CHECK(correct_odometry(odometry, keyframes)[1].T.matrix() == odometry[1].T.matrix());
  CHECK(correct_odometry({}, keyframes).empty());
}

}  // namespace
}  // namespace km
