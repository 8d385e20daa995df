#include "modules/objects/object_merging.hpp"
#include "modules/objects/team_objects.hpp"
#include "test/modules/objects/box_mesh.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

MapObject object(const ObjectBox& box, RobotId robot, double surface_m2 = 1.0) {
  return {.label = kChair,
          .box = box,
          .surface_m2 = surface_m2,
          .views = 4,
          .keyframe = {robot, 1},
          .robots = {robot}};
}

const ObjectBox kBox{{1.0, 2.0, 0.5}, 0.3, {0.8, 0.5, 1.0}};

SE3 any_pose(double x) {
  return make_pose(
      Eigen::AngleAxisd(0.1 * x, Eigen::Vector3d(0.05, 0.0, 1.0).normalized()).toRotationMatrix(),
      {x, 0.0, 1.0});
}

Trajectory trajectory(RobotId robot) {
  return {.robot = robot, .anchor = 0, .T_world_kf = {any_pose(0), any_pose(1), any_pose(2)}};
}

TEST_CASE("A message states the first known keyframe of every ten that have an object") {
  RobotObjects message{.robot = 3, .objects = {}};
  for (const KeyframeIndex k : {17U, 12U, 5U, 11U, 40U})
    message.objects.push_back({.keyframe = k, .T_world_kf = any_pose(k)});
  std::map<KeyframeIndex, OdometryPose> odometry;
  for (const KeyframeIndex k : {17U, 12U, 5U}) odometry[k].id = {3, k};
  const auto keyframes = keyframes_of(message, odometry);
  REQUIRE(keyframes.size() == 2);
  CHECK(keyframes[0].odometry.id.index == 5);
  CHECK(keyframes[1].odometry.id.index == 12);
  CHECK(keyframes[1].T_world_kf.isApprox(any_pose(12)));
  message.objects.clear();
  for (KeyframeIndex k = 0; k < 10 * (kMaxObjectKeyframes + 5); k += 10) {
    message.objects.push_back({.keyframe = k});
    odometry[k].id = {3, k};
  }
  REQUIRE(keyframes_of(message, odometry).size() == kMaxObjectKeyframes);
  CHECK(keyframes_of(message, odometry)[0].odometry.id.index == 50);
}

TEST_CASE("Noisy copies of an object are one, whatever their order") {
  const auto seed = GENERATE(1U, 2U, 3U);
  CAPTURE(seed);
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0.0, 0.03);
  std::vector<MapObject> copies;
  for (RobotId robot = 0; robot < 4; ++robot) {
    ObjectBox box = kBox;
    for (double* value : {&box.center.x(), &box.center.y(), &box.center.z(), &box.yaw_rad})
      *value += noise(random);
    copies.push_back(object(box, robot, 1.0 + 0.1 * robot));
  }
  copies.push_back(object({{2.2, 2.0, 0.5}, 0.3, {0.8, 0.5, 1.0}}, 5, 9.0));  // another chair
  std::shuffle(copies.begin(), copies.end(), random);
  const auto merged = merge_objects(copies, {});
  REQUIRE(merged.size() == 2);
  CHECK(merged[0].robots == std::vector<RobotId>{5});
  CHECK(merged[1].robots == std::vector<RobotId>{0, 1, 2, 3});
  CHECK(intersection_over_union(merged[1].box, kBox) > 0.6);
  CHECK(merged[1].views == 16);
  CHECK(merged[1].surface_m2 == Approx(1.3));
  CHECK(merged[1].keyframe == KeyframeId{3, 1});
}

TEST_CASE("Objects of a team are merged in the joint frame and move with their keyframes") {
  const ObjectsConfig config;
  TeamObjects team(0, config);
  const Trajectory own = trajectory(0), peer = trajectory(7);
  CHECK(team.add(anchored(std::vector{object(kBox, 0, 2.0)}, own)));
  CHECK(team.add(anchored(std::vector{object(kBox, 7)}, peer)));
  ObjectList list = team.joint(own);
  REQUIRE(list.objects.size() == 1);
  CHECK(list.objects[0].robots == std::vector<RobotId>{0, 7});
  CHECK(intersection_over_union(list.objects[0].box, kBox) > 0.97);

  Trajectory moved = own;
  SECTION("own keyframes move own objects") {
    moved.T_world_kf[1] = SE3(Eigen::Translation3d(10.0, 0.0, 0.0)) * moved.T_world_kf[1];
    list = team.joint(moved);
    REQUIRE(list.objects.size() == 2);
    CHECK(list.objects[0].box.center.x() == Approx(kBox.center.x() + 10.0));
    CHECK(list.objects[1].box.center.x() == Approx(kBox.center.x()));
  }
  SECTION("a public pose of another robot moves the objects of that robot") {
    moved.public_poses[{7, 1}] = SE3(Eigen::Translation3d(0.0, 5.0, 0.0)) * peer.T_world_kf[1];
    list = team.joint(moved);
    REQUIRE(list.objects.size() == 2);
    CHECK(list.objects[1].box.center.y() == Approx(kBox.center.y() + 5.0));
  }
  SECTION("objects in another frame are left out") {
    moved.anchor = 3;
    list = team.joint(moved);
    REQUIRE(list.objects.size() == 1);
    CHECK(list.objects[0].robots == std::vector<RobotId>{0});
  }
}

TEST_CASE("The newest message of a robot counts, and none of an earlier incarnation") {
  TeamObjects team(0, {});
  RobotObjects first = anchored(std::vector{object(kBox, 7)}, trajectory(7));
  first.boot = 5;
  RobotObjects second = first;
  second.boot = 6;
  second.objects.clear();
  CHECK(team.add(first));
  CHECK(team.add(second));
  CHECK(team.joint(trajectory(0)).objects.empty());
  CHECK_FALSE(team.add(first));
  CHECK(team.joint(trajectory(0)).objects.empty());
}

TEST_CASE("Only changes that matter differ, and the largest objects are sent") {
  const RobotObjects sent = anchored(std::vector{object(kBox, 7)}, trajectory(7));
  const auto shifted = [](double by_m) {
    Trajectory t = trajectory(7);
    for (SE3& T : t.T_world_kf) T = SE3(Eigen::Translation3d(by_m, 0.0, 0.0)) * T;
    ObjectBox box = kBox;
    box.center.x() += by_m;
    return anchored(std::vector{object(box, 7)}, t);
  };
  CHECK_FALSE(differ(shifted(0.04), sent, 0.05));
  CHECK(differ(shifted(0.06), sent, 0.05));
  CHECK(differ(anchored({}, trajectory(7)), sent, 0.05));

  std::vector<MapObject> many;
  for (std::size_t i = 0; i < kMaxObjects + 3; ++i)
    many.push_back(object(kBox, 7, static_cast<double>(i)));
  const RobotObjects most = anchored(many, trajectory(7));
  REQUIRE(most.objects.size() == kMaxObjects);
  CHECK(most.objects.back().surface_m2 == 3.0);
}

TEST_CASE("A keyframe without an optimised pose is replaced by the last that has one") {
  MapObject late = object(kBox, 7);
  late.keyframe.index = 90;
  const RobotObjects sent = anchored(std::vector{late}, trajectory(7));
  CHECK(sent.objects[0].keyframe == 2);
  TeamObjects team(0, {});
  CHECK(team.add(sent));
  const ObjectList list = team.joint(trajectory(0));
  REQUIRE(list.objects.size() == 1);
  CHECK(intersection_over_union(list.objects[0].box, kBox) > 0.97);
}

}  // namespace
}  // namespace km
