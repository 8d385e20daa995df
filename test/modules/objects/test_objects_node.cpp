#include "modules/objects/node/objects_codec.hpp"
#include "modules/objects/node/objects_node.hpp"
#include "test/modules/objects/box_mesh.hpp"
#include "test/runtime/dds/dds_fixture.hpp"
#include "test/support/captured_log.hpp"
#include "test/support/corrupted_message.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

const ObjectBox kSeen{{1.0, 2.0, 0.5}, 0.3, {0.8, 0.5, 1.0}};

LabelPalette palette() {
  return LabelPalette({{kGround, "floor", {1, 1, 1}}, {kChair, "chair", {2, 2, 2}}});
}

std::shared_ptr<const Trajectory> poses(RobotId robot) {
  return std::make_shared<const Trajectory>(
      Trajectory{.robot = robot, .anchor = 3, .T_world_kf = std::vector<SE3>(10, SE3::Identity())});
}

OptimizedMesh mesh_with(const std::vector<ObjectBox>& chairs, RobotId robot) {
  TestMap map;
  map.add_sheet({-5, -5, 0}, {10, 0, 0}, {0, 10, 0}, kGround, {0, 9});
  for (const ObjectBox& chair : chairs) map.add_box(chair, kChair);
  OptimizedMesh result;
  result.robot = robot;
  result.anchor = 3;
  result.mesh = map.mesh;
  result.trajectory = poses(robot);
  result.origin.seen_by = map.seen_by;
  return result;
}

struct NodeTopics {
  [[nodiscard]] ObjectsTopics ends() {
    return {.meshes = meshes,
            .trajectory = trajectory,
            .received = received,
            .own = own,
            .joint = joint};
  }
  Topic<OptimizedMesh> meshes;
  Topic<Trajectory> trajectory;
  Topic<RobotObjects> received, own;
  Topic<ObjectList> joint;
};

TEST_CASE("Objects are sent after changes only, and no faster than configured") {
  NodeTopics topics;
  Inbox<RobotObjects> sent(topics.own);
  Inbox<ObjectList> joint(topics.joint);
  ObjectsNode node({}, 4, palette(), topics.ends());
  topics.trajectory.publish(poses(4));
  topics.meshes.publish(mesh_with({kSeen}, 4));
  node.step({}, 100.0);
  REQUIRE(sent.messages().size() == 1);
  CHECK(sent.messages()[0].objects.size() == 1);
  REQUIRE(joint.messages().size() == 1);
  CHECK(intersection_over_union(joint.messages()[0].objects.at(0).box, kSeen) > 0.97);

  topics.meshes.publish(mesh_with({kSeen}, 4));
  node.step({}, 110.0);
  CHECK(sent.messages().size() == 1);  // unchanged
  const ObjectBox other{{-2.0, 0.0, 0.5}, 0.0, {0.8, 0.5, 1.0}};
  topics.meshes.publish(mesh_with({kSeen, other}, 4));
  node.step({}, 111.0);
  CHECK(sent.messages().size() == 2);
  topics.meshes.publish(mesh_with({other}, 4));
  node.step({}, 112.0);
  CHECK(sent.messages().size() == 2);  // too early
  node.step({}, 116.0);
  REQUIRE(sent.messages().size() == 3);
  CHECK(sent.messages()[2].objects.size() == 1);
}

TEST_CASE("Messages state the odometry of keyframes that the node has learned") {
  NodeTopics topics;
  Inbox<RobotObjects> sent(topics.own);
  ObjectsNode node({}, 4, palette(), topics.ends());
  topics.trajectory.publish(poses(4));
  for (KeyframeIndex k = 0; k < 10; ++k) {
    OdometryPose learned{.id = {4, k}};
    learned.T_odom_kf.translation().x() = 7.0;
    node.step(learned, 1.0);
  }
  topics.meshes.publish(mesh_with({kSeen}, 4));
  node.step({}, 100.0);
  REQUIRE(sent.messages().size() == 1);
  REQUIRE(sent.messages()[0].keyframes.size() == 1);
  CHECK(sent.messages()[0].keyframes[0].odometry.id.index ==
        sent.messages()[0].objects.at(0).keyframe);
  CHECK(sent.messages()[0].keyframes[0].odometry.T_odom_kf.translation().x() == 7.0);
}

TEST_CASE("Objects of other robots join those of this one, but not in its name") {
  NodeTopics topics;
  Inbox<ObjectList> joint(topics.joint);
  ObjectsNode node({}, 4, palette(), topics.ends());
  topics.trajectory.publish(poses(4));
  topics.meshes.publish(mesh_with({kSeen}, 4));
  const MapObject far{.label = kChair, .box = {{9, 9, 0.5}, 0.0, {1, 1, 1}}, .surface_m2 = 1.0};
  RobotObjects received = anchored(std::vector{far}, *poses(5));
  node.step(std::make_shared<const RobotObjects>(received), 1.0);
  node.step({}, 2.0);
  CHECK(joint.messages().back().objects.size() == 2);
  CapturedLog log;
  received.robot = 4;
  node.step(std::make_shared<const RobotObjects>(received), 3.0);
  node.step({}, 4.0);
  CHECK(joint.messages().back().objects.size() == 2);
  CHECK_THAT(log.text(), Contains("objects of robot 4 are ignored"));
  const auto last = node.finish(*poses(4));
  REQUIRE(last);
  CHECK(last->objects.size() == 2);
}

// A robot with the module that exchanges objects.
struct ObjectRobot {
  ObjectRobot(std::shared_ptr<const DdsDomain> domain, RobotId id)
      : basis(std::move(domain), id),
        node({}, id, palette(),
             {.meshes = meshes,
              .trajectory = trajectory,
              .received = objects.from_peers(),
              .own = objects.to_peers(),
              .joint = joint}) {
    basis.bridge.exchange(objects, TopicKind::kState, TrafficCategory::kMap);
    trajectory.publish(poses(id));
  }
  ~ObjectRobot() {
    node.stop();
    basis.stop();
  }
  void start() {
    basis.start();
    node.start();
  }
  bool knows(const std::vector<RobotId>& robots) {
    return eventually([&] {
      const auto lists = inbox.messages();
      return !lists.empty() && lists.back().objects.size() == 1 &&
             lists.back().objects[0].robots == robots;
    });
  }

  Topic<OptimizedMesh> meshes;
  Topic<Trajectory> trajectory;
  Topic<ObjectList> joint;
  Inbox<ObjectList> inbox{joint};
  Crossing<RobotObjects> objects;
  TestRobot basis;
  ObjectsNode node;
};

TEST_CASE("An object that two robots saw is one at both, also at a robot that joins later") {
  const auto domain = std::make_shared<const DdsDomain>(loopback_config());
  ObjectRobot a(domain, 3), b(domain, 4);
  a.start();
  b.start();
  REQUIRE(b.basis.receives(PeerEventKind::kJoined, 3));
  a.meshes.publish(mesh_with({kSeen}, 3));
  CHECK(b.knows({3}));
  ObjectBox noisy = kSeen;
  noisy.center += Eigen::Vector3d(0.05, -0.03, 0.0);
  b.meshes.publish(mesh_with({noisy}, 4));
  CHECK(a.knows({3, 4}));
  CHECK(b.knows({3, 4}));
  ObjectRobot late(domain, 5);
  late.start();
  CHECK(late.knows({3, 4}));
}

RobotObjects two_objects() {
  const MapObject object{.label = kChair, .box = kSeen, .surface_m2 = 1.5, .views = 4};
  RobotObjects message = anchored(std::vector{object, object}, *poses(70));
  message.boot = 12345;
  message.keyframes = keyframes_of(message, {{0, {.id = {70, 0}}}});
  return message;
}

Arrived<RobotObjects> arrived(const RobotObjects& message) {
  return encoded_by(TeamPeer{message.robot, message.boot}, message);
}

TEST_CASE("Objects are equal after encoding and decoding, with 150 bytes each") {
  const RobotObjects message = two_objects();
  const auto encoded = arrived(message);
  const auto result = decoded(encoded);
  REQUIRE(result.value);
  CHECK_FALSE(differ(*result.value, message, 1e-6));
  CHECK(result.value->robot == 70);
  CHECK(result.value->boot == 12345);
  CHECK(result.value->objects[1].views == 4);
  const std::size_t bytes = serialize(Codec<RobotObjects>::descriptor(), &encoded.wire).size();
  CHECK(bytes < 2 * 150 + kSurfaceKeyframeBytes + 32);
  REQUIRE(result.value->keyframes.size() == 1);
  CHECK(result.value->keyframes == message.keyframes);
}

TEST_CASE("Entries of unknown layers are left out") {
  auto message = arrived(two_objects());
  message.objects[0].layer = 1;
  REQUIRE(decoded(message).value);
  CHECK(decoded(message).value->objects.size() == 1);
}

TEST_CASE("The largest message of objects is accepted by size") {
  RobotObjects message = two_objects();
  message.objects.resize(kMaxObjects, message.objects[0]);
  message.keyframes.resize(kMaxObjectKeyframes, message.keyframes[0]);
  const auto encoded = arrived(message);
  CHECK(serialize(Codec<RobotObjects>::descriptor(), &encoded.wire).size() <=
        Codec<RobotObjects>::kMaxBytes);
  CHECK(decoded(encoded).value);
}

TEST_CASE("Impossible objects are refused") {
  const char* const missing = "objects are missing or too many";
  const char* const pose = "a pose of an object is none";
  const char* const size = "an object has no usable size";
  const char* const keyframes = "keyframes of objects are missing or too many";
  const char* const odometry = "a keyframe of objects has no pose or is of another robot";
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  check_refusals<RobotObjects>(
      [] { return arrived(two_objects()); },
      {{"objects not there", missing, [](auto& m) { m.wire.objects._buffer = nullptr; }},
       {"objects without end", missing, [](auto& m) { m.wire.objects._length = 0xffffffffU; }},
       {"no rotation", pose, [](auto& m) { m.objects[1].T_kf_box.q[3] = 9.0; }},
       {"a position at infinity", pose, [](auto& m) { m.objects[0].T_world_kf.t[1] = 1e300; }},
       {"a position that is no number", pose, [](auto& m) { m.objects[0].T_kf_box.t[0] = kNan; }},
       {"a negative side", size, [](auto& m) { m.objects[0].size_m[2] = -1.0F; }},
       {"a side that is no number", size, [](auto& m) { m.objects[0].size_m[0] = kNan; }},
       {"a side as long as a planet", size, [](auto& m) { m.objects[0].size_m[1] = 1e7F; }},
       {"keyframes without end", keyframes,
        [](auto& m) { m.wire.keyframes._length = 0xffffffffU; }},
       {"a keyframe of another robot", odometry,
        [](auto& m) { m.keyframes[0].odometry.keyframe.robot = 71; }},
       {"a keyframe without odometry", odometry,
        [](auto& m) { m.keyframes[0].odometry.q[3] = 9.0F; }},
       {"a keyframe without a pose", odometry,
        [](auto& m) { m.keyframes[0].T_world_kf.t[0] = 1e300; }},
       {"no surface", size, [](auto& m) { m.objects[1].surface_m2 = kNan; }}});
}

}  // namespace
}  // namespace km
