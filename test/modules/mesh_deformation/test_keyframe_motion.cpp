#include <catch2/catch.hpp>
#include <random>
#include <vector>

#include "modules/core/lie.hpp"
#include "modules/mesh_deformation/keyframe_motion.hpp"
#include "test/support/random_pose.hpp"

namespace km {
namespace {

constexpr MotionScale kScale{.translation_m = 0.01, .rotation_rad = 0.005};
constexpr double kRounding = 1e-9;  // in units of the scale, for poses within 10 m

std::vector<SE3> random_poses(std::mt19937& rng, std::size_t count) {
  std::vector<SE3> poses;
  for (std::size_t i = 0; i < count; ++i) poses.push_back(random_pose(rng));
  return poses;
}

std::vector<SE3> moved(const SE3& T, const std::vector<SE3>& poses) {
  std::vector<SE3> result;
  for (const SE3& pose : poses) result.push_back(T * pose);
  return result;
}

TEST_CASE("A motion of all keyframes together is no bending", "[mesh_deformation]") {
  const auto count = GENERATE(1U, 2U, 30U);
  const auto seed = GENERATE(range(0U, 5U));
  CAPTURE(count, seed);
  std::mt19937 rng(seed);
  const std::vector<SE3> before = random_poses(rng, count);
  const SE3 T = random_pose(rng);
  const KeyframeMotion motion = keyframe_motion(before, moved(T, before), kScale);
  CHECK(motion.T_after_before.isApprox(T, 1e-9));
  CHECK(motion.bending < kRounding);
  CHECK(largest_difference(before, T, motion.T_after_before, kScale) < kRounding);
}

TEST_CASE("One keyframe that moves against many others is found", "[mesh_deformation]") {
  const auto seed = GENERATE(range(0U, 5U));
  CAPTURE(seed);
  std::mt19937 rng(seed);
  constexpr std::size_t kCount = 1000;
  const std::vector<SE3> before = random_poses(rng, kCount);
  std::vector<SE3> after = moved(random_pose(rng), before);
  // The others' motion takes on a share of about 1 / kCount of the odd one's.
  SECTION("by three times the scale of translation") {
    after[7].translation() += Eigen::Vector3d(0.0, 0.03, 0.0);
    CHECK(keyframe_motion(before, after, kScale).bending == Approx(3.0).epsilon(0.02));
  }
  SECTION("by three times the scale of rotation") {
    after[7].linear() *= so3_exp({0.0, 0.0, 0.015});
    CHECK(keyframe_motion(before, after, kScale).bending == Approx(3.0).epsilon(0.02));
  }
}

TEST_CASE("The common motion weighs rotations against translations", "[mesh_deformation]") {
  // Two keyframes 2 m apart on x. Their positions turn by +a about z, their axes by -a. Per the
  // sum of squares, (1 m * sin)^2 / translation^2 for each position against sin^2 / rotation^2.
  const double a = 0.01;
  const std::vector<SE3> before = {make_pose(Eigen::Matrix3d::Identity(), {1, 0, 0}),
                                   make_pose(Eigen::Matrix3d::Identity(), {-1, 0, 0})};
  const Eigen::Matrix3d R = so3_exp({0, 0, a});
  const std::vector<SE3> after = {make_pose(R.transpose(), R * Eigen::Vector3d(1, 0, 0)),
                                  make_pose(R.transpose(), R * Eigen::Vector3d(-1, 0, 0))};
  const double w_t = 1.0 / (0.01 * 0.01);
  const double w_r = 1.0 / (0.005 * 0.005);
  const KeyframeMotion motion = keyframe_motion(before, after, kScale);
  const double angle = so3_log(motion.T_after_before.linear()).z();
  CHECK(angle == Approx(a * (w_t - w_r) / (w_t + w_r)).epsilon(1e-3));
}

TEST_CASE("Solutions are compared over the keyframes both have", "[mesh_deformation]") {
  std::mt19937 rng(1);
  const std::vector<SE3> before = random_poses(rng, 5);
  std::vector<SE3> after = before;
  after.push_back(random_pose(rng));
  CHECK(keyframe_motion(before, after, kScale).bending < kRounding);
  CHECK(keyframe_motion({}, after, kScale).bending == 0.0);
}

TEST_CASE("Two motions differ by what they differ at the pose they move apart most",
          "[mesh_deformation]") {
  const std::vector<SE3> poses = {SE3::Identity(),
                                  make_pose(Eigen::Matrix3d::Identity(), {20.0, 0.0, 0.0})};
  const SE3 turn = make_pose(so3_exp({0.0, 0.0, 0.002}), Eigen::Vector3d::Zero());
  const SE3 shift = make_pose(Eigen::Matrix3d::Identity(), {0.0, 0.02, 0.0});
  CHECK(largest_difference(poses, SE3::Identity(), turn, kScale) == Approx(4.0).epsilon(1e-3));
  CHECK(largest_difference({poses.data(), 1}, turn, SE3::Identity(), kScale) == Approx(0.4));
  CHECK(largest_difference(poses, shift, SE3::Identity(), kScale) == Approx(2.0));
}

TEST_CASE("Keyframes without an optimised pose follow odometry from the last that has one",
          "[mesh_deformation]") {
  std::mt19937 rng(2);
  const std::vector<SE3> odometry = random_poses(rng, 4);
  const SE3 T_world_odom = random_pose(rng);
  std::vector<SE3> optimised = moved(T_world_odom, odometry);
  const std::vector<SE3> expected = optimised;
  optimised.resize(2);
  const std::vector<SE3> all = complete(odometry, optimised);
  REQUIRE(all.size() == 4);
  for (std::size_t i = 0; i < 4; ++i) CHECK(all[i].isApprox(expected[i], 1e-12));
  CHECK(complete({}, {}).empty());
}

}  // namespace
}  // namespace km
