#include <catch2/catch.hpp>

#include <memory>
#include <vector>

#include "modules/loop_closure/node/loop_closure_codec.hpp"
#include "modules/mesh/node/mesh_codec.hpp"
#include "modules/surface_ties/node/surface_ties_node.hpp"
#include "test/modules/surface_ties/chunks.hpp"
#include "test/modules/surface_ties/tied_robot.hpp"
#include "test/runtime/dds/dds_fixture.hpp"
#include "test/support/inbox.hpp"

namespace km {
namespace {

// A robot that sends its chunks, ties its surfaces to those of others, and sends each tie to the
// other robot.
struct Tier {
  Tier(const std::shared_ptr<const DdsDomain>& domain, RobotId robot)
      : basis(domain, robot),
        ties(robot, kMaxGap,
             {.own_chunks = own_chunks,
              .peer_chunks = chunks.from_peers(),
              .own_poses = own_poses,
              .peer_poses = poses.from_peers(),
              .closures = closures.from_peers(),
              .progress = progress,
              .restarts = restarts,
              .ties = made,
              .outcomes = outcomes}),
        received(closures.from_peers()) {
    basis.bridge.exchange(chunks, TopicKind::kState, TrafficCategory::kMap);
    basis.bridge.exchange(poses, TopicKind::kState, TrafficCategory::kMap);
    basis.bridge.exchange(closures, TopicKind::kEvent, TrafficCategory::kGeometricVerification);
    own_chunks.subscribe([this](const auto& chunk) { chunks.to_peers().publish(chunk); });
    made.subscribe([this](const auto& tie) {
      closures.to_peers().publish({tie->to.id.robot, tie});
    });
    ties.start();
    basis.start();
  }
  ~Tier() {
    basis.stop();
    ties.stop();
  }

  Topic<MeshChunk> own_chunks;
  Crossing<MeshChunk> chunks{};
  Topic<MeshPoses> own_poses;
  Crossing<MeshPoses> poses{};
  Topic<Closure> made;
  AddressedCrossing<Closure> closures{};
  Topic<OptimizerProgress> progress;
  Topic<PeerEvent> restarts;
  Topic<ClosureOutcome> outcomes;
  TestRobot basis;
  SurfaceTiesNode ties;
  Inbox<Closure> received;
};

}  // namespace

TEST_CASE("A tie of two robots' surfaces arrives at the other robot as a closure", "[node][dds]") {
  const auto domain = std::make_shared<const DdsDomain>(loopback_config());
  Tier a(domain, 1), b(domain, 2);
  REQUIRE(b.basis.receives(PeerEventKind::kJoined, 1));
  const SE3 T_error = make_pose(so3_exp({0.01, 0.0, 0.0}), {0.03, 0.02, -0.03});
  for (const MeshChunk& chunk : room_chunks(1, 12, SE3::Identity())) a.own_chunks.publish(chunk);
  for (const MeshChunk& chunk : room_chunks(2, 35, T_error)) b.own_chunks.publish(chunk);
  OptimizerProgress state;
  state.members = {1, 2};
  for (Tier* robot : {&a, &b}) robot->progress.publish(state);
  const auto ties = b.received.wait_until([](const auto& all) { return !all.empty(); });
  REQUIRE(ties.size() == 1);
  CHECK(ties[0].id() == closure_id({1, 12}, {2, 35}));
  const SE3 expected = pose_in_room(1, 12).inverse() * pose_in_room(2, 35);
  CHECK((ties[0].T_from_to.translation() - expected.translation()).norm() < 0.005);
  CHECK(a.received.messages().empty());  // the robot with the lower id makes the ties
}

TEST_CASE("The node publishes a tie of two robots' chunks as a closure with its outcome",
          "[node]") {
  constexpr RobotId kSelf = 1, kOther = 2;
  TiedRobot robot(kSelf);
  const SE3 T_error = make_pose(so3_exp({0.01, 0.0, 0.0}), {0.03, 0.02, -0.03});
  for (const MeshChunk& chunk : room_chunks(kSelf, 12, SE3::Identity())) robot.give(chunk);
  for (const MeshChunk& chunk : room_chunks(kOther, 35, T_error)) robot.give(chunk);
  OptimizerProgress state;
  state.members = {kSelf, kOther};
  SECTION("two robots in one frame") {
    robot.give(state);
    robot.run();
    REQUIRE(robot.made.messages().size() == 1);
    CHECK(robot.made.messages()[0].id() == closure_id({kSelf, 12}, {kOther, 35}));
    REQUIRE(robot.reported.messages().size() == 1);
    CHECK(robot.reported.messages()[0].stage == ClosureStage::kVerified);
  }
  SECTION("a tentative pose") {
    state.tentative = {kOther};
    robot.give(state);
    robot.run();
    CHECK(robot.made.messages().empty());
  }
}

}  // namespace km
