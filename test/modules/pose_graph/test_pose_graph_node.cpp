#include <catch2/catch.hpp>

#include <condition_variable>
#include <mutex>
#include <optional>

#include "modules/pose_graph/pose_graph_node.hpp"
#include "test/support/captured_log.hpp"
#include "test/support/patience.hpp"
#include "test/support/split_graph.hpp"

namespace km {
namespace {

// One robot's node with its topics.
struct Robot {
  explicit Robot(PgoPeer peer, PgoMethod method = PgoMethod::kNewton)
      : self(peer), node({.method = method}, peer, topics()) {
    trajectory.subscribe([this](const auto& message) {
      const std::lock_guard lock(mutex);
      latest = *message;
      changed.notify_all();
    });
  }

  PoseGraphTopics topics() {
    return {odometry,      closures,   inlier_sets,    peer_inlier_sets, peer_events, peer_status,
            peer_sessions, peer_poses, peer_exchanges, status,           sessions,    poses,
            exchanges,     trajectory, progress,       verdicts};
  }

  void hears(Robot& other) {
    other.status.subscribe([this](const auto& m) { peer_status.publish(m); });
    other.sessions.subscribe([this](const auto& m) { peer_sessions.publish(m); });
    other.poses.subscribe([this](const auto& m) { peer_poses.publish(m); });
    other.exchanges.subscribe([this](const auto& m) { peer_exchanges.publish(m); });
  }

  void meet(const Robot& other) {
    PeerEvent event{.kind = PeerEventKind::kJoined, .identity = {}, .text = {}};
    event.identity.robot = other.self.robot;
    event.identity.boot = other.self.boot;
    peer_events.publish(event);
  }

  // Odometry, closures, then the decision, which robot 2 makes for the pair.
  void publish_measurements(const SplitGraph& graph) {
    KeyframeOdometry first;
    first.id = {self.robot, 0};
    odometry.publish(first);
    for (const RelativePose& e : graph.odometry)
      if (e.from.robot == self.robot) odometry.publish(keyframe_odometry(e));
    for (const RelativePose& e : graph.closures) closures.publish(make_closure(e));
    auto& decided = self.robot == 2 ? inlier_sets : peer_inlier_sets;
    decided.publish(inlier_set(graph, 2, 9));
  }

  // Waits for a trajectory in the frame of `anchor`.
  std::optional<Trajectory> await_trajectory(RobotId anchor, std::size_t size) {
    std::unique_lock lock(mutex);
    const bool came = changed.wait_for(lock, kPatience, [&] {
      return latest && latest->anchor == anchor && latest->T_world_kf.size() == size;
    });
    return came ? latest : std::nullopt;
  }

  PgoPeer self;
  Topic<KeyframeOdometry> odometry;
  Topic<Closure> closures;
  Topic<InlierSet> inlier_sets, peer_inlier_sets;
  Topic<PeerEvent> peer_events;
  Topic<PgoStatus> peer_status, status;
  Topic<PgoSession> peer_sessions, sessions;
  Topic<PublicPoses> peer_poses, poses;
  Topic<SolverMessage> peer_exchanges, exchanges;
  Topic<Trajectory> trajectory;
  Topic<OptimizerProgress> progress;
  Topic<ClosureVerdicts> verdicts;
  std::mutex mutex;
  std::condition_variable changed;
  std::optional<Trajectory> latest;
  PoseGraphNode node;  // last member: stops first
};

// Two robots on parallel lines one metre apart, exact.
SplitGraph parallel_lines() {
  SplitGraph graph{.keyframes = {{2, 5}, {9, 5}}, .odometry = {}, .closures = {}};
  const Matrix6 covariance = covariance_of({.kappa = 100.0, .tau = 10.0});
  const SE3 forward = make_pose(Eigen::Matrix3d::Identity(), {1.0, 0.0, 0.0});
  const SE3 beside = make_pose(Eigen::Matrix3d::Identity(), {0.0, 1.0, 0.0});
  for (const RobotId robot : {RobotId{2}, RobotId{9}})
    for (std::uint32_t i = 0; i < 4; ++i)
      graph.odometry.push_back({{robot, i}, {robot, i + 1}, forward, covariance});
  graph.closures = {{{2, 1}, {9, 1}, beside, covariance},
                    {{9, 3}, {2, 3}, beside.inverse(), covariance}};
  return graph;
}

constexpr double kSinglePrecision_m = 1e-5;

}  // namespace

TEST_CASE("two nodes on their threads end in one frame", "[pose_graph][node]") {
  const PgoMethod method = GENERATE(PgoMethod::kRbcd, PgoMethod::kNewton, PgoMethod::kGnc);
  CAPTURE(to_string(method));
  const SplitGraph graph = parallel_lines();
  Robot two({2, 11}, method);
  Robot nine({9, 12}, method);
  two.hears(nine);
  nine.hears(two);
  two.node.start();
  nine.node.start();
  two.meet(nine);
  nine.meet(two);
  two.publish_measurements(graph);
  nine.publish_measurements(graph);
  const auto of_two = two.await_trajectory(2, 5);
  const auto of_nine = nine.await_trajectory(2, 5);
  // What one publishes may fill the queue of the other: sources are stopped together.
  two.node.stop();
  nine.node.stop();
  CHECK(two.node.error() == nullptr);
  CHECK(nine.node.error() == nullptr);
  REQUIRE(of_two);
  REQUIRE(of_nine);
  for (std::size_t i = 0; i < 5; ++i) {
    const Eigen::Vector3d expected(static_cast<double>(i), 1.0, 0.0);
    CHECK((of_nine->T_world_kf[i].translation() - expected).norm() < kSinglePrecision_m);
  }
}

TEST_CASE("a node alone publishes its own trajectory and status", "[pose_graph][node]") {
  const SplitGraph graph = parallel_lines();
  Robot nine({9, 12});
  int statuses = 0;
  nine.status.subscribe([&](const auto&) { ++statuses; });
  KeyframeOdometry first;
  first.id = {9, 0};
  double now_s = 100.0;
  nine.node.step(std::make_shared<const KeyframeOdometry>(first), now_s);
  for (const RelativePose& e : graph.odometry)
    if (e.from.robot == 9)
      nine.node.step(std::make_shared<const KeyframeOdometry>(keyframe_odometry(e)), now_s += 2.0);
  REQUIRE(nine.latest);
  CHECK(nine.latest->anchor == 9);
  CHECK(nine.latest->T_world_kf.size() == 5);
  CHECK(statuses == 5);  // each is due: two seconds have passed
}

TEST_CASE("a robot with another method is named and left alone", "[pose_graph][node]") {
  Robot two({2, 11}, PgoMethod::kNewton);
  const CapturedLog log;
  const PgoStatus status{.sender = {9, 12}, .frame = {9, 12}, .method = PgoMethod::kRbcd};
  for (int k = 0; k < 20; ++k) two.node.step(std::make_shared<const PgoStatus>(status), 1.0);
  CHECK(log.lines().size() == 1);
  CHECK_THAT(log.text(), Catch::Contains("robot 9 optimises by 'rbcd', this one by 'newton'"));
}

TEST_CASE("a configuration out of bounds is refused", "[pose_graph][node]") {
  PoseGraphConfig config;
  config.rank = 2;
  Robot robot({1, 1});
  CHECK_THROWS_AS(PoseGraphNode(config, {1, 1}, robot.topics()), ConfigError);
}

}  // namespace km
