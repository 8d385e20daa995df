#include "modules/core/geometry/precision.hpp"
#include "modules/rbcd/solver_choice.hpp"
#include "modules/session/node/team_node.hpp"
#include "test/support/captured_log.hpp"
#include "test/support/patience.hpp"
#include "test/support/split_graph.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

// The node of one robot with its topics.
struct Robot {
  explicit Robot(TeamPeer peer, PgoMethod method = PgoMethod::kNewton)
      : self(peer),
        node(
            {.method = method}, peer, solver_choice({.method = method}), [] { return 0U; },
            topics()) {
    trajectory.subscribe([this](const auto& message) {
      const std::lock_guard lock(mutex);
      latest = *message;
      changed.notify_all();
    });
  }

  TeamTopics topics() {
    return {.odometry = odometry,
            .closures = closures,
            .fixes = fixes,
            .inlier_sets = inlier_sets,
            .peer_inlier_sets = peer_inlier_sets,
            .restored_inlier_sets = restored_inlier_sets,
            .peer_events = peer_events,
            .restarts = restarts,
            .links = links,
            .peer_messages = peer_messages,
            .messages = messages,
            .trajectory = trajectory,
            .progress = progress,
            .verdicts = verdicts};
  }

  // Delivers the messages that `other` sends to this robot.
  void receives(Robot& other) {
    other.messages.subscribe([this](const auto& message) {
      const auto* reliable = std::get_if<ReliableMessage>(message.get());
      if (reliable == nullptr || reliable->to == self.robot) peer_messages.publish(message);
    });
  }

  void meet(const Robot& other) {
    PeerEvent event{.kind = PeerEventKind::kJoined, .identity = {}, .text = {}};
    event.identity.robot = other.self.robot;
    event.identity.boot = other.self.boot;
    peer_events.publish(event);
    LinksReport report{.links = {}, .version = 1};
    report.links.report(self.robot, {other.self.robot});
    report.links.report(other.self.robot, {self.robot});
    links.publish(report);
  }

  // Odometry, closures, then the inlier set, which robot 2 decides for the pair.
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

  TeamPeer self;
  Topic<KeyframeOdometry> odometry;
  Topic<Closure> closures;
  Topic<PositionFix> fixes;
  Topic<InlierSet> inlier_sets, peer_inlier_sets, restored_inlier_sets;
  Topic<PeerEvent> peer_events, restarts;
  Topic<LinksReport> links;
  Topic<TeamMessage> peer_messages, messages;
  Topic<Trajectory> trajectory;
  Topic<OptimizerProgress> progress;
  Topic<ClosureVerdicts> verdicts;
  std::mutex mutex;
  std::condition_variable changed;
  std::optional<Trajectory> latest;
  TeamNode node;  // last member: stops first
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

TEST_CASE("Two nodes on their threads end in one frame") {
  const PgoMethod method = GENERATE(PgoMethod::kRbcd, PgoMethod::kNewton);
  CAPTURE(to_string(method));
  const SplitGraph graph = parallel_lines();
  Robot two({2, 11}, method);
  Robot nine({9, 12}, method);
  two.receives(nine);
  nine.receives(two);
  two.node.start();
  nine.node.start();
  two.meet(nine);
  nine.meet(two);
  two.publish_measurements(graph);
  nine.publish_measurements(graph);
  const auto of_two = two.await_trajectory(2, 5);
  const auto of_nine = nine.await_trajectory(2, 5);
  // Messages of one node may fill the queue of the other, so both sources are stopped together.
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

TEST_CASE("A node alone publishes its own trajectory and sends no session") {
  const SplitGraph graph = parallel_lines();
  Robot nine({9, 12});
  int other_messages = 0;
  nine.messages.subscribe([&](const auto& message) {
    other_messages += std::holds_alternative<TeamStatus>(*message) ? 0 : 1;
  });
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
  CHECK(other_messages == 0);
}

TEST_CASE("A node sends its status only when it has changed") {
  Robot two({2, 11});
  std::vector<TeamStatus> statuses;
  two.messages.subscribe([&](const auto& message) {
    if (const auto* status = std::get_if<TeamStatus>(message.get())) statuses.push_back(*status);
  });
  KeyframeOdometry first;
  first.id = {2, 0};
  two.node.step(Tick(), 100.0);
  REQUIRE(statuses.size() == 1);
  two.node.step(Tick(), 110.0);
  CHECK(statuses.size() == 1);
  two.node.step(std::make_shared<const KeyframeOdometry>(first), 111.0);
  REQUIRE(statuses.size() == 2);
  CHECK(statuses.back().keyframes == 1);
}

TEST_CASE("Refusals of the agent are logged at a limited rate") {
  const CapturedLog log;
  Robot two({2, 11});
  KeyframeOdometry third;
  third.id = {2, 3};
  for (int k = 0; k < 100; ++k)
    two.node.step(std::make_shared<const KeyframeOdometry>(third), 100.0 + k);
  const std::string text = log.text();
  CHECK(text.find("not the next one") != std::string::npos);
  CHECK(std::count(text.begin(), text.end(), '\n') < 20);
}

}  // namespace
}  // namespace km
