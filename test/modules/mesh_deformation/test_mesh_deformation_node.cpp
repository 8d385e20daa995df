#include "modules/mesh_deformation/node/mesh_deformation_node.hpp"
#include "runtime/clock.hpp"
#include "test/modules/mesh_deformation/corridor.hpp"
#include "test/support/captured_log.hpp"
#include "test/support/inbox.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

constexpr RobotId kSelf = 4;
// A robot's mapper, odometry and pose graph, as seen by this node.
struct Robot {
  MeshDeformationTopics topics() {
    return {.maps = maps,
            .keyframes = keyframes,
            .trajectory = trajectory,
            .optimized = optimized,
            .superseded = superseded};
  }

  [[nodiscard]] std::shared_ptr<const KeyframeOdometry> keyframe(std::size_t i) const {
    return std::make_shared<const KeyframeOdometry>(
        KeyframeOdometry{.id = {kSelf, static_cast<KeyframeIndex>(i)}, .T_odom_kf = T_odom_kf[i]});
  }
  [[nodiscard]] std::shared_ptr<const Trajectory> solution(double radius_m) const {
    return std::make_shared<const Trajectory>(
        Trajectory{.robot = kSelf, .anchor = 2, .T_world_kf = bent(T_odom_kf, radius_m)});
  }
  [[nodiscard]] std::vector<OptimizedMesh> results() { return inbox.messages(); }

  Topic<MapMesh> maps;
  Topic<KeyframeOdometry> keyframes;
  Topic<Trajectory> trajectory;
  Topic<OptimizedMesh> optimized;
  Topic<SupersededSurface> superseded;
  Inbox<OptimizedMesh> inbox{optimized};
  std::vector<SE3> T_odom_kf = keyframes_above(kSheet);
  std::shared_ptr<const MapMesh> map = std::make_shared<const MapMesh>(sheet(kSheet));
};

MeshDeformationConfig every_two_seconds() {
  MeshDeformationConfig config{.period_s = 2.0};
  return config;
}

// Position of the last vertex in the bent corridor.
double last_vertex_x(double radius_m) {
  return bend(make_pose(Eigen::Matrix3d::Identity(), {8.0, 2.0, 0.0}), radius_m).translation().x();
}

// Passes the map with all its keyframes to the node.
void show_map(const Robot& robot, MeshDeformationNode& node) {
  for (std::size_t i = 0; i < robot.T_odom_kf.size(); ++i) node.step(robot.keyframe(i), 0.0);
  node.step(robot.map, 0.0);
}

const MeshDeformationNode::Input kTick = Tick();
const MeshDeformationNode::Input kEnd = MeshEnd();

// Time in steps far longer than any correction.
class Hours {
 public:
  explicit Hours(MeshDeformationNode& node) : node_(node) {}
  void tick() { node_.step(kTick, now_s_ += 3600.0); }

 private:
  MeshDeformationNode& node_;
  double now_s_ = 1e9;
};

TEST_CASE("The mesh deformation node publishes the optimised mesh") {
  Robot robot;
  MeshDeformationNode node(every_two_seconds(), kSelf, robot.topics());
  Hours hours(node);
  show_map(robot, node);
  hours.tick();
  CHECK(robot.results().empty());  // no trajectory yet
  node.step(robot.solution(20.0), 0.0);
  CHECK(robot.results().empty());
  hours.tick();
  REQUIRE(robot.results().size() == 1);
  const OptimizedMesh result = robot.results().front();
  CHECK(result.robot == kSelf);
  CHECK(result.anchor == 2);
  const auto expected =
      optimize_mesh(*robot.map, robot.T_odom_kf, robot.solution(20.0)->T_world_kf);
  CHECK(result.mesh.vertices == expected.mesh.vertices);
  CHECK(result.mesh.faces == robot.map->mesh.faces);
  CHECK(node.timing().count() == 1);

  hours.tick();
  node.step(robot.solution(20.0), 0.0);
  hours.tick();
  CHECK(robot.results().size() == 1);  // nothing has moved
  node.step(robot.solution(30.0), 0.0);
  node.step(robot.solution(40.0), 0.0);
  hours.tick();
  REQUIRE(robot.results().size() == 2);  // the newest trajectory only
  CHECK(robot.results()[1].mesh.vertices.back().x() == Approx(last_vertex_x(40.0)).margin(0.05));
}

TEST_CASE("A correction waits until the last one is a period old") {
  Robot robot;
  MeshDeformationNode node(every_two_seconds(), kSelf, robot.topics());
  show_map(robot, node);
  node.step(robot.solution(20.0), 0.0);
  const double start_s = steady_now_s();
  node.step(kTick, start_s);
  REQUIRE(robot.results().size() == 1);
  node.step(robot.solution(10.0), start_s);
  node.step(kTick, start_s + 1.99);
  CHECK(robot.results().size() == 1);
  node.step(kTick, steady_now_s() + 3600.0);
  CHECK(robot.results().size() == 2);
}

TEST_CASE("A map that arrives before its keyframes waits for them") {
  Robot robot;
  MeshDeformationNode node(every_two_seconds(), kSelf, robot.topics());
  Hours hours(node);
  node.step(robot.map, 0.0);
  node.step(robot.solution(20.0), 0.0);  // has more keyframes than are known
  for (std::size_t i = 0; i + 1 < robot.T_odom_kf.size(); ++i) node.step(robot.keyframe(i), 0.0);
  hours.tick();
  CHECK(robot.results().empty());
  node.step(robot.keyframe(robot.T_odom_kf.size() - 1), 0.0);
  hours.tick();
  CHECK(robot.results().size() == 1);
}

TEST_CASE("The last correction is from scratch and no other follows") {
  Robot robot;
  MeshDeformationNode node(every_two_seconds(), kSelf, robot.topics());
  show_map(robot, node);
  node.step(robot.solution(20.0), 0.0);
  const double now_s = steady_now_s();
  node.step(kTick, now_s);
  Trajectory last = *robot.solution(20.0);
  // Below the threshold and before the period is over
  last.T_world_kf[3].translation().z() += 0.001;
  node.step(std::make_shared<const Trajectory>(last), now_s);
  node.step(kEnd, now_s);
  REQUIRE(robot.results().size() == 2);
  const auto expected = optimize_mesh(*robot.map, robot.T_odom_kf, last.T_world_kf);
  CHECK(robot.results()[1].mesh.vertices == expected.mesh.vertices);
  node.step(robot.solution(10.0), now_s);
  node.step(kEnd, now_s + 3600.0);
  CHECK(robot.results().size() == 2);
}

TEST_CASE("A last map that cannot be corrected is reported") {
  Robot robot;
  MeshDeformationNode node(every_two_seconds(), kSelf, robot.topics());
  node.step(robot.keyframe(0), 0.0);
  node.step(robot.map, 0.0);
  const CapturedLog log;
  node.step(kEnd, 0.0);
  CHECK_THAT(log.text(), Contains("the last map is not corrected"));
  CHECK(robot.results().empty());
}

TEST_CASE("A mesh is current once it is corrected, also if there is none") {
  Robot robot;
  MeshDeformationConfig config{.period_s = 0.01};
  MeshDeformationNode node(config, kSelf, robot.topics());
  const auto becomes_current = [&] {
    const auto end = std::chrono::steady_clock::now() + kPatience;
    while (!node.is_current() && std::chrono::steady_clock::now() < end)
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    return node.is_current();
  };
  CHECK(node.is_current());
  robot.trajectory.publish(robot.solution(20.0));
  CHECK_FALSE(node.is_current());
  node.start();
  CHECK(becomes_current());  // there is no map
  for (std::size_t i = 0; i < robot.T_odom_kf.size(); ++i)
    robot.keyframes.publish(robot.keyframe(i));
  robot.maps.publish(robot.map);
  CHECK(becomes_current());
  CHECK_FALSE(robot.results().empty());
  node.stop();
}

}  // namespace
}  // namespace km
