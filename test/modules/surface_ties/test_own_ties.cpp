#include <catch2/catch.hpp>

#include <algorithm>
#include <memory>
#include <vector>

#include "modules/rbcd/solver_choice.hpp"
#include "test/modules/surface_ties/tied_robot.hpp"
#include "test/modules/surface_ties/visits.hpp"
#include "test/support/team_network.hpp"

namespace km {
namespace {

constexpr RobotId kSelf = DriftingRobot::kId;

// Views of two visits, one before and one after the drift.
constexpr SeenBy kEarly = {4, 12}, kLate = {68, 76};

// A robot and what its node receives.
struct Scene {
  DriftingRobot robot = {};
  std::vector<SeenSurface> surfaces = {};
  std::vector<ClosureId> closures = {};
  bool located = true;
};

Closure closure_between(const ClosureId& id) {
  Closure closure;
  closure.from.id = id.from;
  closure.to.id = id.to;
  return closure;
}

// The ties of a node that has received all of this.
std::vector<Closure> ties_of(const Scene& scene) {
  TiedRobot robot(kSelf);
  OptimizerProgress state{.members = {kSelf}};
  state.located = scene.located;
  robot.give(state);
  for (const OdometryPose& keyframe : scene.robot.odometry()) robot.node.step(keyframe, 0.0);
  for (const ClosureId& id : scene.closures) robot.give(closure_between(id));
  for (const MeshChunk& chunk : chunks_of(scene.robot, scene.surfaces)) robot.give(chunk);
  robot.run();
  return robot.made.messages();
}

SE3 true_pose(const Closure& tie) {
  return DriftingRobot::truth(tie.from.id.index).inverse() * DriftingRobot::truth(tie.to.id.index);
}

double error_m(const SE3& T, const SE3& truth) {
  return (T.translation() - truth.translation()).norm();
}

double error_deg(const SE3& T, const SE3& truth) {
  return angle_of(T.linear().transpose() * truth.linear()) * kDegrees;
}

LabelledMesh moved(LabelledMesh mesh, const Eigen::Vector3d& by) {
  mesh.transform(make_pose(Eigen::Matrix3d::Identity(), by));
  return mesh;
}

// The back-end of the robot alone, with these closures.
struct BackEnd {
  BackEnd(const DriftingRobot& robot, const std::vector<Closure>& closures) {
    TeamAgent& agent = network.add({kSelf, 1}, {}, solver_choice({}));
    for (KeyframeIndex k = 0; k < DriftingRobot::kKeyframes; ++k) {
      KeyframeOdometry keyframe{.id = {kSelf, k}, .T_odom_kf = robot.estimate(k)};
      keyframe.T_previous_kf =
          k == 0 ? robot.estimate(0) : robot.estimate(k - 1).inverse() * robot.estimate(k);
      if (k > 0) keyframe.covariance = robot.step_covariance();
      REQUIRE(agent.add(keyframe));
    }
    InlierSet all{kSelf, kSelf, 1, {}};
    for (const Closure& closure : closures) {
      REQUIRE(agent.add(closure));
      all.closures.push_back(closure.id());
    }
    std::ranges::sort(all.closures);
    REQUIRE(agent.add(all));
    REQUIRE(settle(network));
  }
  [[nodiscard]] SE3 pose(KeyframeIndex k) const {
    return network.robots.at(kSelf).trajectory->T_world_kf[k];
  }
  [[nodiscard]] bool keeps(const Closure& closure) const {
    return network.robots.at(kSelf).agent->decided().at(closure.id());
  }
  // Error of the pose of keyframe b relative to a.
  [[nodiscard]] double error_m(KeyframeIndex a, KeyframeIndex b) const {
    return km::error_m(pose(a).inverse() * pose(b),
                       DriftingRobot::truth(a).inverse() * DriftingRobot::truth(b));
  }
  TeamNetwork network;
};

// A closure from images, with an error of 5 mm.
Closure image_closure(KeyframeIndex from, KeyframeIndex to) {
  Closure closure = closure_between(closure_id({kSelf, from}, {kSelf, to}));
  closure.T_from_to = true_pose(closure) * Eigen::Translation3d(0.003, -0.004, 0.0);
  closure.covariance = Vector6::Constant(0.01 * 0.01).asDiagonal();
  return closure;
}

}  // namespace

TEST_CASE("A robot that drifts by 5 cm and 1 degree is tied to its earlier visit", "[own_ties]") {
  const DriftingRobot robot;
  const std::vector<Closure> ties =
      ties_of({robot, {{inside_of_room(), kEarly}, {inside_of_room(), kLate}}});
  REQUIRE(ties.size() == 1);
  CHECK(ties[0].id() == closure_id({kSelf, 4}, {kSelf, 68}));
  CHECK(is_covariance(ties[0].covariance));
  CHECK(error_m(robot.estimate(4).inverse() * robot.estimate(68), true_pose(ties[0])) > 0.03);
  CHECK(error_m(ties[0].T_from_to, true_pose(ties[0])) < 0.005);
  CHECK(error_deg(ties[0].T_from_to, true_pose(ties[0])) < 0.2);
  const BackEnd solved(robot, ties);
  CHECK(solved.keeps(ties[0]));
  CHECK(solved.error_m(8, 72) < 0.01);
  CHECK(solved.error_m(20, 150) < 0.03);
}

TEST_CASE("Surfaces of one visit are never tied", "[own_ties]") {
  SECTION("few keyframes between the views") {
    CHECK(ties_of({{}, {{inside_of_room(), {20, 52}}, {inside_of_room(), {67, 76}}}}).empty());
  }
  SECTION("one more keyframe between the views") {
    CHECK(ties_of({{}, {{inside_of_room(), {20, 48}}, {inside_of_room(), {68, 100}}}}).size() == 1);
  }
  SECTION("a surface in view all the time") {
    CHECK(ties_of({{}, {{inside_of_room(), {4, 76}}}}).empty());
  }
}

TEST_CASE("A corridor is not tied along itself to an earlier visit", "[own_ties]") {
  CHECK(ties_of({{}, {{corridor(), kEarly}, {corridor(), kLate}}}).empty());
}

TEST_CASE("A robot whose odometry is more precise than surfaces is not tied", "[own_ties]") {
  DriftingRobot robot;
  robot.sigma_rad = robot.sigma_m = 1e-5;
  CHECK(ties_of({robot, {{inside_of_room(), kEarly}, {inside_of_room(), kLate}}}).empty());
}

TEST_CASE("A robot is not tied to itself before it is located", "[own_ties]") {
  Scene scene{{}, {{inside_of_room(), kEarly}, {inside_of_room(), kLate}}, {}, false};
  CHECK(ties_of(scene).empty());
}

TEST_CASE("A room that changed between two visits is not tied", "[own_ties]") {
  CHECK(ties_of({{}, {{inside_of_room(), kEarly}, {inside_of_room(4.2F), kLate}}}).empty());
}

TEST_CASE("Ties inside a robot do not count twice", "[own_ties]") {
  Scene scene{{}, {{inside_of_room(), kEarly}, {inside_of_room(), kLate}}, {}, true};
  SECTION("a closure at the same place") {
    scene.closures = {closure_id({kSelf, 15}, {kSelf, 64})};
    CHECK(ties_of(scene).empty());
  }
  SECTION("a closure elsewhere") {
    scene.closures = {closure_id({kSelf, 15}, {kSelf, 100})};
    CHECK(ties_of(scene).size() == 1);
  }
  SECTION("three visits form a chain") {
    scene.surfaces.push_back({inside_of_room(), {124, 132}});
    const std::vector<Closure> ties = ties_of(scene);
    REQUIRE(ties.size() == 2);
    CHECK(ties[0].from.id != ties[1].from.id);
    CHECK(ties[0].to.id != ties[1].to.id);
  }
}

TEST_CASE("A surface that moved as a whole between two visits does not win", "[own_ties]") {
  // The room moves by 20 cm, more than odometry can err. All surfaces fit, so that a tie is made.
  DriftingRobot robot;
  robot.drift = SE3::Identity();
  robot.sigma_m = 0.001;
  robot.sigma_rad = 0.0003;
  std::vector<Closure> closures = ties_of(
      {robot, {{inside_of_room(), kEarly}, {moved(inside_of_room(), {0.2, 0.0, 0.0}), kLate}}});
  REQUIRE(closures.size() == 1);
  const Closure lie = closures[0];
  CHECK(error_m(lie.T_from_to, true_pose(lie)) > 0.15);
  SECTION("alone against odometry") {}
  SECTION("against closures from images") {
    for (const KeyframeIndex k : {0U, 25U, 50U}) closures.push_back(image_closure(k, k + 70));
  }
  const BackEnd solved(robot, closures);
  CHECK_FALSE(solved.keeps(lie));
  CHECK(solved.error_m(8, 72) < 0.01);
}

}  // namespace km
