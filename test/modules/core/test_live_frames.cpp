#include "modules/core/data/live_frames.hpp"
#include "modules/core/data/odometry_correction.hpp"
#include "modules/core/geometry/lie.hpp"
#include "test/support/random_pose.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

constexpr Stamp kPeriod = 50'000'000;

OdometryState state_at(int k) {
  OdometryState state{.stamp = 1'000'000'000 + k * kPeriod};
  state.T_odom_body =
      make_pose(so3_exp(Eigen::Vector3d(0, 0, 0.02 * k)), Eigen::Vector3d(0.1 * k, 0, 1));
  return state;
}

KeyframeOdometry keyframe_at(int k, KeyframeIndex index) {
  KeyframeOdometry keyframe;
  keyframe.id = {3, index};
  keyframe.stamp = state_at(k).stamp;
  return keyframe;
}

TEST_CASE("The newest keyframe has its pose in the pose graph") {
  LiveFrames frames;
  CHECK(frames.T_map_odom().isApprox(SE3::Identity()));
  for (int k = 0; k <= 20; ++k) {
    frames.add(state_at(k));
    if (k % 10 == 0) frames.add(keyframe_at(k, static_cast<KeyframeIndex>(k / 10)));
  }
  const SE3 T = make_pose(so3_exp(Eigen::Vector3d(0.1, 0.2, 0.3)), Eigen::Vector3d(4, 5, 6));
  // The third keyframe is not optimised yet.
  frames.add(Trajectory{3, 3, {SE3::Identity(), T}});
  CHECK((frames.T_map_odom() * state_at(10).T_odom_body).isApprox(T, 1e-12));
  frames.add(Trajectory{3, 3, {SE3::Identity(), SE3::Identity(), T}});
  CHECK((frames.T_map_odom() * state_at(20).T_odom_body).isApprox(T, 1e-12));
  CHECK(frames.keyframe_stamps() ==
        std::vector{state_at(0).stamp, state_at(10).stamp, state_at(20).stamp});
  CHECK(frames.angular_rate().isApprox(Eigen::Vector3d(0, 0, 0.4), 1e-9));  // 0.02 rad in 50 ms
}

TEST_CASE("The pose in the map has the covariance of the trajectory and of the steps since") {
  LiveFrames frames;
  const auto add = [&](int k, KeyframeIndex index) {
    frames.add(state_at(k));
    KeyframeOdometry keyframe = keyframe_at(k, index);
    keyframe.T_previous_kf = make_pose(Eigen::Matrix3d::Identity(), {1.0, 0.0, 0.0});
    keyframe.covariance = 0.01 * Matrix6::Identity();
    frames.add(keyframe);
  };
  for (int k = 0; k < 3; ++k) add(10 * k, static_cast<KeyframeIndex>(k));
  const UncertainPose step{make_pose(Eigen::Matrix3d::Identity(), {1.0, 0.0, 0.0}),
                           0.01 * Matrix6::Identity()};
  const UncertainPose two = compose(step, step);
  const SE3& T_odom_body = state_at(20).T_odom_body;
  CHECK(frames.T_map_body(T_odom_body).Sigma.isApprox(two.Sigma, 1e-12));
  // A session that has solved the first two keyframes.
  Trajectory trajectory{3, 3, {SE3::Identity(), SE3::Identity()}};
  trajectory.covariances = {Matrix6::Zero(), 0.5 * Matrix6::Identity()};
  frames.add(trajectory);
  const UncertainPose solved{SE3::Identity(), 0.5 * Matrix6::Identity()};
  CHECK(frames.T_map_body(T_odom_body).Sigma.isApprox(compose(solved, step).Sigma, 1e-12));
  frames.add(Trajectory{3, 3, {SE3::Identity(), SE3::Identity()}});  // in the next session
  CHECK(frames.T_map_body(T_odom_body).Sigma.isApprox(compose(solved, step).Sigma, 1e-12));
}

TEST_CASE("The pose in the map has the error of the map's scale") {
  LiveFrames frames;
  frames.add(state_at(0));
  frames.add(keyframe_at(0, 0));
  Trajectory trajectory{3, 3, {make_pose(Eigen::Matrix3d::Identity(), {300.0, 400.0, 0.0})}};
  trajectory.covariances = {Matrix6::Zero()};
  trajectory.scale_sigma = 0.01;
  frames.add(trajectory);
  const UncertainPose pose = frames.T_map_body(state_at(0).T_odom_body);
  CHECK(along_fixed_axes(pose).topLeftCorner<3, 3>().trace() == Approx(5.0 * 5.0));
}

TEST_CASE("Keyframes of an earlier incarnation do not correct odometry") {
  LiveFrames frames;
  frames.add(state_at(0));
  frames.add(keyframe_at(0, 7));
  frames.add(Trajectory{3, 3, std::vector<SE3>(7, SE3::Identity())});
  CHECK(frames.T_map_odom().isApprox(SE3::Identity()));
  CHECK(frames.keyframe_stamps().size() == 8);
}

SE3 at(double x, double y, double yaw = 0.0) {
  return make_pose(so3_exp({0, 0, yaw}), Eigen::Vector3d(x, y, 0));
}

TEST_CASE("Odometry beyond the last optimised keyframe follows it rigidly") {
  // In the optimised graph the body turned left while moving to (0, 1); in odometry it went
  // straight.
  const std::vector<StampedPose> odometry = {{0, at(0, 0)}, {1, at(1, 0)}, {2, at(3, 0)}};
  const std::vector<StampedPose> keyframes = {{0, at(0, 0)}, {1, at(0, 1, std::numbers::pi / 2)}};
  const auto corrected = correct_odometry(odometry, keyframes);
  REQUIRE(corrected.size() == 3);
  CHECK((corrected[1].T.matrix() - keyframes[1].T.matrix()).norm() < 1e-12);
  CHECK((corrected[2].T.translation() - Eigen::Vector3d(0, 3, 0)).norm() < 1e-12);
}

TEST_CASE("Between two keyframes the correction is interpolated in time") {
  const std::vector<StampedPose> odometry = {{0, at(0, 0)}, {1, at(1, 0)}, {4, at(4, 0)}};
  const std::vector<StampedPose> keyframes = {{0, at(0, 0)}, {4, at(4, 2)}};
  const auto corrected = correct_odometry(odometry, keyframes);
  CHECK((corrected[1].T.translation() - Eigen::Vector3d(1, 0.5, 0)).norm() < 1e-12);
}

TEST_CASE("A rigid change of frame moves every pose rigidly") {
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

TEST_CASE("Without a common instant odometry is returned unchanged") {
  const std::vector<StampedPose> odometry = {{0, at(0, 0)}, {2, at(1, 0)}};
  const std::vector<StampedPose> keyframes = {{1, at(9, 9)}};
  CHECK(correct_odometry(odometry, keyframes)[1].T.matrix() == odometry[1].T.matrix());
  CHECK(correct_odometry({}, keyframes).empty());
}

}  // namespace
}  // namespace km
