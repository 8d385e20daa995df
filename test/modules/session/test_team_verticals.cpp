#include "modules/core/geometry/lie.hpp"
#include "modules/rbcd/solver_choice.hpp"
#include "test/support/team_network.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

// Two robots drive side by side over level ground, with closures in two rows. The pitch of the
// odometry of each robot drifts, and the estimated tilt of their first keyframes is wrong.
struct Drive {
  TeamPoses truth = {};
  std::map<RobotId, std::vector<KeyframeOdometry>> odometry = {};
  std::vector<Closure> closures = {};
};

Eigen::Vector3d up_at(const SE3& T) {
  return T.linear().transpose() * Eigen::Vector3d::UnitZ();
}

double tilt_between(const SE3& a, const SE3& b) {
  const Eigen::Vector3d z = Eigen::Vector3d::UnitZ();
  return std::acos(std::clamp((a.linear() * up_at(b)).dot(z), -1.0, 1.0));
}

Drive level_drive(double tilt_of_first) {
  constexpr std::uint32_t kLength = 30;
  Drive drive;
  const SE3 drift = make_pose(so3_exp({0.0, 0.002, 0.0}), Eigen::Vector3d::Zero());
  for (const RobotId robot : {RobotId{1}, RobotId{2}}) {
    std::vector<SE3>& truth = drive.truth[robot];
    for (std::uint32_t k = 0; k < kLength; ++k) {
      truth.push_back(make_pose(Eigen::Matrix3d::Identity(), {1.0 * k, 2.0 * robot, 0.0}));
      KeyframeOdometry keyframe;
      keyframe.id = {robot, k};
      if (k == 0) {
        const Eigen::Matrix3d tilted = so3_exp({0.0, tilt_of_first * robot, 0.0});
        keyframe.T_odom_kf = make_pose(tilted, Eigen::Vector3d::Zero());
      } else {
        keyframe.T_previous_kf = truth[k - 1].inverse() * truth[k] * drift;
      }
      keyframe.covariance = Matrix6::Identity() * 4e-6;
      keyframe.vertical = Vertical{up_at(truth[k]), 5e-3};
      drive.odometry[robot].push_back(keyframe);
    }
  }
  for (const std::uint32_t k : {0U, 5U, 10U, 22U, 25U, 29U}) {
    Closure closure;
    closure.from.id = {1, k};
    closure.to.id = {2, k};
    closure.T_from_to = drive.truth[1][k].inverse() * drive.truth[2][k];
    closure.covariance = Matrix6::Identity() * 1e-4;
    drive.closures.push_back(closure);
  }
  return drive;
}

TeamPoses drive_to_the_end(const Drive& drive, const PoseGraphConfig& config) {
  TeamNetwork network;
  for (const auto& [robot, keyframes] : drive.odometry) {
    TeamAgent& agent = network.add({robot, 1}, config, solver_choice(config));
    for (const KeyframeOdometry& keyframe : keyframes) (void)agent.add(keyframe);
    InlierSet set{1, 2, 1, {}};
    for (const Closure& closure : drive.closures) {
      (void)agent.add(closure);
      set.closures.push_back(closure.id());
    }
    (void)agent.add(set);
  }
  REQUIRE(settle(network));
  for (const auto& [id, robot] : network.robots) CHECK(robot.notices.empty());
  return network.trajectories();
}

TEST_CASE("the solution of a team with verticals is level") {
  PoseGraphConfig config;
  config.method = GENERATE(PgoMethod::kRbcd, PgoMethod::kNewton);
  config.robust = GENERATE(true, false);
  CAPTURE(to_string(config.method), config.robust);
  const Drive drive = level_drive(0.01);
  const TeamPoses poses = drive_to_the_end(drive, config);
  double worst = 0.0;
  for (const auto& [robot, truth] : drive.truth)
    for (std::size_t k = 0; k < truth.size(); ++k)
      worst = std::max(worst, tilt_between(poses.at(robot)[k], truth[k]));
  // Odometry alone would have a pitch of 58 mrad at the end.
  CHECK(worst < 0.012);
  // Keyframe 0 of the anchor has its position from odometry, and its tilt from the team.
  const SE3& first = poses.at(1)[0];
  CHECK(first.translation().norm() < 1e-6);
  CHECK(std::abs(so3_log(first.linear()).z()) < 1e-6);
}

TEST_CASE("one robot without verticals disables them for the team") {
  Drive one = level_drive(0.0), none = level_drive(0.0);
  for (KeyframeOdometry& keyframe : one.odometry.at(2)) keyframe.vertical.reset();
  for (auto& [robot, keyframes] : none.odometry)
    for (KeyframeOdometry& keyframe : keyframes) keyframe.vertical.reset();
  const TeamPoses with = drive_to_the_end(one, {}), without = drive_to_the_end(none, {});
  for (const auto& [robot, poses] : with)
    for (std::size_t k = 0; k < poses.size(); ++k)
      CHECK(poses[k].isApprox(without.at(robot)[k], 1e-5));
}

}  // namespace
}  // namespace km
