#include <catch2/catch.hpp>

#include <optional>
#include <vector>

#include "modules/core/covariance.hpp"
#include "modules/core/lie.hpp"
#include "modules/surface_ties/tie_search.hpp"
#include "test/modules/surface_ties/chunks.hpp"
#include "test/modules/surface_ties/visits.hpp"

namespace km {
namespace {

constexpr RobotId kOwn = 1, kPeer = 2;

const SE3 kError = make_pose(so3_exp({0.0, 0.01, -0.01}), {0.03, -0.03, 0.03});

struct Search {
  Search() {
    search.set_joined({kOwn, kPeer});
    add(room_chunks(kOwn, 12, SE3::Identity()), 0.0);
    add(room_chunks(kPeer, 35, kError), 0.0);
  }
  void add(const std::vector<MeshChunk>& chunks, double now_s) {
    for (const MeshChunk& chunk : chunks) search.add(chunk, now_s);
  }
  // The ties that all steps from now on make.
  std::vector<Closure> ties(double now_s) {
    std::vector<Closure> all;
    for (int i = 0; i < 20; ++i)
      if (auto tie = search.step(now_s)) all.push_back(*tie);
    return all;
  }
  TieSearch search{kOwn, kMaxGap};
};

constexpr double kLater_s = 100.0;

}  // namespace

TEST_CASE("A tie corrects the estimated pose of two robots in one room", "[tie_search]") {
  Search robots;
  CHECK(robots.ties(1.0).empty());  // chunks may still arrive
  CHECK_FALSE(robots.search.is_done());
  const std::vector<Closure> ties = robots.ties(kLater_s);
  REQUIRE(ties.size() == 1);
  CHECK(robots.search.is_done());
  CHECK(ties[0].from.id == KeyframeId{kOwn, 12});
  CHECK(ties[0].to.id == KeyframeId{kPeer, 35});
  const SE3 expected = pose_in_room(kOwn, 12).inverse() * pose_in_room(kPeer, 35);
  CHECK((ties[0].T_from_to.translation() - expected.translation()).norm() < 0.005);
  CHECK(is_covariance(ties[0].covariance));
}

TEST_CASE("No tie counts twice or beside a closure", "[tie_search]") {
  Search robots;
  SECTION("a closure at the same place") {
    robots.search.add(closure_id({kOwn, 4}, {kPeer, 40}));
    CHECK(robots.ties(kLater_s).empty());
  }
  SECTION("a closure elsewhere") {
    robots.search.add(closure_id({kOwn, 4}, {kPeer, 60}));
    CHECK(robots.ties(kLater_s).size() == 1);
  }
  SECTION("chunks that change after the tie") {
    CHECK(robots.ties(kLater_s).size() == 1);
    robots.add(room_chunks(kPeer, 36, SE3::Identity()), kLater_s);
    CHECK(robots.ties(2 * kLater_s).empty());
  }
  CHECK(robots.search.is_done());
}

TEST_CASE("Robots whose relative pose is not certain are not tied", "[tie_search]") {
  Search robots;
  robots.search.set_joined({kOwn});
  CHECK(robots.ties(kLater_s).empty());
  CHECK(robots.search.is_done());
  robots.search.set_joined({kOwn, kPeer});
  CHECK(robots.ties(kLater_s).size() == 1);
}

TEST_CASE("The robot with the lower id makes the ties of a pair", "[tie_search]") {
  TieSearch search(kPeer, kMaxGap);
  search.set_joined({kOwn, kPeer});
  for (const RobotId robot : {kOwn, kPeer})
    for (const MeshChunk& chunk : room_chunks(robot, 12, SE3::Identity())) search.add(chunk, 0.0);
  CHECK_FALSE(search.step(kLater_s));
  CHECK(search.is_done());
}

TEST_CASE("Ties between robots do not wait for the registrations inside a robot", "[tie_search]") {
  const DriftingRobot robot;
  TieSearch search(DriftingRobot::kId, kMaxGap);
  search.set_joined({DriftingRobot::kId, kPeer});
  for (const OdometryPose& keyframe : robot.odometry()) search.learn(keyframe);
  for (const MeshChunk& chunk : room_chunks(kPeer, 35, kError)) search.add(chunk, 0.0);
  const std::vector<SeenSurface> visits = {{inside_of_room(), {4, 12}},
                                           {inside_of_room(), {68, 76}}};
  for (const MeshChunk& chunk : chunks_of(robot, visits)) search.add(chunk, 0.0);
  std::vector<RobotId> tied;
  std::vector<int> steps;
  for (int i = 1; i <= 20; ++i)
    if (const auto tie = search.step(kLater_s)) {
      tied.push_back(tie->to.id.robot);
      steps.push_back(i);
    }
  CHECK(tied == std::vector<RobotId>{kPeer, DriftingRobot::kId});
  CHECK(steps == std::vector<int>{3, 5});  // after two registrations, and after one more
  CHECK(search.is_done());
}

TEST_CASE("A tie begins at the present poses of chunks that were sent before", "[tie_search]") {
  TieSearch search(kOwn, kMaxGap);
  search.set_joined({kOwn, kPeer});
  const SE3 far = make_pose(so3_exp({0, 0, 1.0}), {100, 0, 0});
  const bool poses_first = GENERATE(false, true);
  const auto poses = room_poses(kPeer, 35, kError);
  for (const MeshChunk& chunk : room_chunks(kOwn, 12, SE3::Identity())) search.add(chunk, 0.0);
  if (poses_first) search.add(poses, 0.0);
  for (const MeshChunk& chunk : room_chunks(kPeer, 35, far)) search.add(chunk, 0.0);
  if (!poses_first) {
    for (int i = 0; i < 9; ++i) CHECK_FALSE(search.step(kLater_s));
    CHECK(search.is_done());
    search.add(poses, kLater_s);
    CHECK_FALSE(search.is_done());
  }
  std::size_t ties = 0;
  for (int i = 0; i < 20; ++i) ties += search.step(2 * kLater_s) ? 1 : 0;
  CHECK(ties == 1);
  const SE3 near = make_pose(kError.linear(), kError.translation() + Eigen::Vector3d(0.02, 0, 0));
  search.add(room_poses(kPeer, 35, near), 2 * kLater_s);
  CHECK(search.is_done());
}

TEST_CASE("The surface of a restarted robot is discarded", "[tie_search]") {
  Search robots;
  robots.search.forget(kPeer);
  CHECK(robots.ties(kLater_s).empty());
  CHECK(robots.search.is_done());
}

}  // namespace km
