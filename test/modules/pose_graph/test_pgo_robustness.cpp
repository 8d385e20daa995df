#include <catch2/catch.hpp>

#include "test/support/pgo_team.hpp"
#include "test/support/random_team.hpp"

namespace km {
namespace {

constexpr double kHour_s = 3600.0;
constexpr double kTolerance = 1e-4;  // of the cost, relative

PoseGraphConfig config_of(PgoMethod method) {
  PoseGraphConfig config;
  config.method = method;
  return config;
}

void add(PgoTeam& team, const SplitGraph& graph, RobotId robot, PgoMethod method,
         std::uint64_t boot = 1) {
  feed(team.add({robot, boot}, config_of(method)), robot, graph);
}

void check_common_frame(PgoTeam& team, const SplitGraph& graph, RobotId anchor) {
  for (const auto& [robot, count] : graph.keyframes) {
    CAPTURE(robot);
    REQUIRE(team.trajectory(robot) != nullptr);
    CHECK(team.trajectory(robot)->anchor == anchor);
    CHECK(team.trajectory(robot)->T_world_kf.size() == count);
  }
}

void check_optimal(PgoTeam& team, const SplitGraph& graph, RobotId anchor) {
  check_common_frame(team, graph, anchor);
  CHECK(rounded_cost(team, graph) < optimum_of(graph) * (1.0 + kTolerance));
}

bool settle(PgoTeam& team) {
  return team.run(kHour_s, [&] { return team.all_settled(); });
}

}  // namespace

TEST_CASE("measurements may come in any order", "[pose_graph][agent]") {
  const PgoMethod method = GENERATE(PgoMethod::kRbcd, PgoMethod::kNewton);
  CAPTURE(to_string(method));
  const unsigned seed = GENERATE(1U, 2U, 3U);
  CAPTURE(seed);
  const SplitGraph graph = random_team(seed, kIds, 12, kRing);
  std::mt19937 rng(seed);
  PgoTeam team;
  for (const RobotId robot : kIds) {
    PgoAgent& agent = team.add({robot, 1}, config_of(method));
    for (const auto& [other, count] : graph.keyframes)
      (void)agent.add(inlier_set(graph, std::min(robot, other), std::max(robot, other)));
    auto closures = graph.closures;
    std::shuffle(closures.begin(), closures.end(), rng);
    for (int copy = 0; copy < 2; ++copy)
      for (const RelativePose& e : closures) (void)agent.add(make_closure(e));
    (void)team.run(0.01);
    feed_odometry(agent, robot, graph);
  }
  REQUIRE(settle(team));
  check_optimal(team, graph, 7);
}

TEST_CASE("a team keeps up with robots that are still moving", "[pose_graph][agent]") {
  const PgoMethod method = GENERATE(PgoMethod::kRbcd, PgoMethod::kNewton);
  CAPTURE(to_string(method));
  const SplitGraph graph = random_team(4, kIds, 30, kRing);
  PgoTeam team({.max_delay_s = 0.01});
  for (const RobotId robot : kIds) {
    PgoAgent& agent = team.add({robot, 1}, config_of(method));
    KeyframeOdometry first;
    first.id = {robot, 0};
    (void)agent.add(first);
  }
  std::map<std::pair<RobotId, RobotId>, InlierSet> sets;
  for (std::uint32_t i = 1; i < 30; ++i) {
    for (const RelativePose& e : graph.odometry)
      if (e.to.index == i) (void)team.agent(e.to.robot).add(keyframe_odometry(e));
    for (const RelativePose& e : graph.closures) {
      if (std::max(e.from.index, e.to.index) != i) continue;
      const auto pair = std::minmax({e.from.robot, e.to.robot});
      InlierSet& set = sets[pair];
      std::tie(set.a, set.b) = pair;
      ++set.version;
      set.closures.push_back({e.from, e.to});
      std::sort(set.closures.begin(), set.closures.end());
      for (const RobotId robot : {set.a, set.b}) {
        (void)team.agent(robot).add(set);
        (void)team.agent(robot).add(make_closure(e));
      }
    }
    (void)team.run(0.1);
  }
  REQUIRE(settle(team));
  check_optimal(team, graph, 7);
}

TEST_CASE("a late robot is taken in", "[pose_graph][agent]") {
  const PgoMethod method = GENERATE(PgoMethod::kRbcd, PgoMethod::kNewton);
  CAPTURE(to_string(method));
  const SplitGraph graph = random_team(5, kIds, 12, kRing);
  const RobotId late = GENERATE(RobotId{7}, RobotId{1200});
  CAPTURE(late);
  PgoTeam team;
  for (const RobotId robot : kIds)
    if (robot != late) add(team, graph, robot, method);
  REQUIRE(settle(team));
  add(team, graph, late, method);
  REQUIRE(settle(team));
  check_optimal(team, graph, 7);
}

TEST_CASE("two teams that meet become one", "[pose_graph][agent]") {
  const PgoMethod method = GENERATE(PgoMethod::kRbcd, PgoMethod::kNewton);
  CAPTURE(to_string(method));
  const SplitGraph graph = random_team(6, kIds, 12, kRing);
  PgoTeam team;
  for (const RobotId robot : kIds) {
    PgoAgent& agent = team.add({robot, 1}, config_of(method));
    feed_odometry(agent, robot, graph);
    for (const RelativePose& e : graph.closures) (void)agent.add(make_closure(e));
  }
  const auto tell = [&](RobotId a, RobotId b) {
    for (const RobotId robot : {a, b}) (void)team.agent(robot).add(inlier_set(graph, a, b));
  };
  tell(7, 33);
  tell(50, 1200);
  REQUIRE(team.run(kHour_s, [&] {
    return team.progress(33).settled && team.progress(33).members.size() == 2 &&
           team.progress(1200).settled && team.progress(1200).members.size() == 2;
  }));
  CHECK(team.trajectory(33)->anchor == 7);
  CHECK(team.trajectory(1200)->anchor == 50);
  tell(33, 50);
  tell(7, 1200);
  REQUIRE(settle(team));
  check_optimal(team, graph, 7);
}

TEST_CASE("the others go on when a robot is lost, in the frame they had", "[pose_graph][agent]") {
  const PgoMethod method = GENERATE(PgoMethod::kRbcd, PgoMethod::kNewton);
  CAPTURE(to_string(method));
  const RobotId gone = GENERATE(RobotId{7}, RobotId{33}, RobotId{1200});
  const int after_updates = GENERATE(1, 9, 30, 1000);
  CAPTURE(gone, after_updates);
  const SplitGraph graph = random_team(7, kIds, 12, kRing);
  PgoTeam team({.max_delay_s = 0.005});
  for (const RobotId robot : kIds) add(team, graph, robot, method);
  int updates = 0;
  team.on_update = [&](RobotId) { ++updates; };
  (void)team.run(kHour_s, [&] { return updates >= after_updates || team.all_settled(); });
  std::set<RobotId> in_frame_of_7;
  for (const RobotId robot : kIds) {
    const Trajectory* trajectory = team.trajectory(robot);
    if (trajectory != nullptr && trajectory->anchor == 7) in_frame_of_7.insert(robot);
  }
  team.remove(gone);
  const double lost_at_s = team.now_s();
  REQUIRE(settle(team));
  CHECK(team.now_s() - lost_at_s < 5.0);
  for (const RobotId robot : kIds) {
    if (robot == gone) continue;
    CAPTURE(robot);
    CHECK(team.progress(robot).members.size() == 3);
    if (in_frame_of_7.contains(robot)) CHECK(team.trajectory(robot)->anchor == 7);
  }
}

TEST_CASE("a robot that was out of reach is taken in again", "[pose_graph][agent]") {
  const PgoMethod method = GENERATE(PgoMethod::kRbcd, PgoMethod::kNewton);
  CAPTURE(to_string(method));
  const RobotId away = GENERATE(RobotId{7}, RobotId{50});
  const int after_updates = GENERATE(5, 20, 1000);
  CAPTURE(away, after_updates);
  const SplitGraph graph = random_team(8, kIds, 12, kRing);
  PgoTeam team({.max_delay_s = 0.005});
  for (const RobotId robot : kIds) add(team, graph, robot, method);
  int updates = 0;
  team.on_update = [&](RobotId) { ++updates; };
  (void)team.run(kHour_s, [&] { return updates >= after_updates || team.all_settled(); });
  team.disconnect(away);
  (void)team.run(3.0);
  team.reconnect(away);
  REQUIRE(settle(team));
  check_optimal(team, graph, 7);
}

TEST_CASE("a restarted robot starts anew and is taken in", "[pose_graph][agent]") {
  const PgoMethod method = GENERATE(PgoMethod::kRbcd, PgoMethod::kNewton);
  CAPTURE(to_string(method));
  const RobotId restarted = GENERATE(RobotId{7}, RobotId{50});
  CAPTURE(restarted);
  const SplitGraph graph = random_team(9, kIds, 12, kRing);
  PgoTeam team({.max_delay_s = 0.005});
  for (const RobotId robot : kIds) add(team, graph, robot, method);
  (void)team.run(0.05);
  team.remove(restarted);
  (void)team.run(0.5);
  add(team, graph, restarted, method, 2);
  for (const RobotId robot : kIds)  // closures with the new process are found again
    if (robot != restarted) feed(team.agent(robot), robot, graph);
  REQUIRE(settle(team));
  check_optimal(team, graph, 7);
}

TEST_CASE("early stopping ends a session after its rounds", "[pose_graph][agent]") {
  const PgoMethod method = GENERATE(PgoMethod::kRbcd, PgoMethod::kNewton);
  CAPTURE(to_string(method));
  const SplitGraph graph = random_team(10, kIds, 30, kRing);
  PoseGraphConfig config = config_of(method);
  config.max_rounds = 5;
  config.min_relative_decrease = 0.0;
  PgoTeam team;
  for (const RobotId robot : kIds) feed(team.add({robot, 1}, config), robot, graph);
  REQUIRE(settle(team));
  for (const RobotId robot : kIds) CHECK(team.progress(robot).round <= 10);  // 5 of them alone
  check_common_frame(team, graph, 7);
}

TEST_CASE("messages that lie are refused or do no lasting harm", "[pose_graph][agent]") {
  const PgoMethod method = GENERATE(PgoMethod::kRbcd, PgoMethod::kNewton);
  CAPTURE(to_string(method));
  const unsigned seed = GENERATE(1U, 2U, 3U);
  CAPTURE(seed);
  std::mt19937 rng(seed);
  const SplitGraph graph = random_team(11, kIds, 12, kRing);
  PgoTeam team;
  for (const RobotId robot : kIds) add(team, graph, robot, method);
  PgoAgent& victim = team.agent(33);
  victim.peer_alive({666, 1});
  std::uniform_int_distribution<std::uint32_t> any(0, 20);
  PublicPoses poses{.sender = {666, 1}, .keyframes = {0}, .X = lifted_identity(5)};
  PublicPoses bad = poses;
  bad.X(1, 3) = std::numeric_limits<double>::quiet_NaN();
  CHECK_FALSE(victim.receive(bad));
  bad = poses;
  bad.X *= 2.0;  // not on the Stiefel manifold
  CHECK_FALSE(victim.receive(bad));
  bad = poses;
  bad.keyframes = {0, 0};
  CHECK_FALSE(victim.receive(bad));
  bad = poses;
  bad.X = lifted_identity(4);
  CHECK_FALSE(victim.receive(bad));
  bad = poses;
  bad.sender.robot = 33;  // the victim itself
  CHECK_FALSE(victim.receive(bad));
  for (int k = 0; k < 200; ++k) {
    PgoStatus status{
        .sender = {666, 1}, .frame = {7, 1}, .keyframes = any(rng), .revision = any(rng)};
    status.method = method;
    status.offers.push_back({33, any(rng) + 1, {any(rng), any(rng)}});
    CHECK(victim.receive(status));
    PgoSession session{.id = {{666, 1}, any(rng)},
                       .plan = {.frame = {7, 1},
                                .members = {{{33, 1}, 0}, {{666, 1}, 0}},
                                .pairs = {{33, 666, {1, any(rng)}}}}};
    session.rank = 5;
    (void)victim.receive(session);
    session.plan.members.push_back({{33, 1}, 0});
    CHECK_FALSE(victim.receive(session));
    poses.session = session.id;
    poses.round = any(rng);
    poses.cost = -1e30;
    CHECK(victim.receive(poses));
    (void)team.run(0.002);
  }
  victim.peer_lost(666);
  REQUIRE(settle(team));
  check_optimal(team, graph, 7);
}

TEST_CASE("after any history of links the team ends at the optimum", "[pose_graph][agent]") {
  const PgoMethod method = GENERATE(PgoMethod::kRbcd, PgoMethod::kNewton);
  CAPTURE(to_string(method));
  const unsigned seed = GENERATE(range(1U, 21U));
  CAPTURE(seed);
  std::mt19937 rng(seed);
  const SplitGraph graph = random_team(seed, kIds, 12, kRing);
  PgoTeam team({.max_delay_s = 0.01, .duplicated = 0.1, .lost = 0.02, .seed = seed});
  std::uniform_int_distribution<std::size_t> any(0, kIds.size() - 1);
  std::uniform_real_distribution<double> pause_s(0.0, 0.3);
  std::set<RobotId> started, fed, away;
  for (int event = 0; event < 40; ++event) {
    const RobotId robot = kIds[any(rng)];
    if (started.insert(robot).second)
      feed_odometry(team.add({robot, 1}, config_of(method)), robot, graph);
    else if (fed.insert(robot).second)
      feed(team.agent(robot), robot, graph);
    else if (away.insert(robot).second)
      team.disconnect(robot);
    else if (away.erase(robot) > 0)
      team.reconnect(robot);
    (void)team.run(pause_s(rng));
  }
  for (const RobotId robot : away) team.reconnect(robot);
  for (const RobotId robot : kIds)
    if (!started.contains(robot)) (void)team.add({robot, 1}, config_of(method));
  for (const RobotId robot : kIds) feed(team.agent(robot), robot, graph);
  REQUIRE(team.run(60.0, [&] { return team.all_settled(); }));
  check_optimal(team, graph, 7);
}

}  // namespace km
