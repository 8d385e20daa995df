#include "modules/session/team_message_bytes.hpp"
#include "test/support/scripted_solver.hpp"
#include "test/support/team_network.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

const std::vector<RobotId> kIds{7, 33, 50, 1200};
const std::vector<std::pair<RobotId, RobotId>> kRing{{7, 33}, {33, 50}, {50, 1200}, {7, 1200}};

MemberSolverFactory gather(ScriptedSolver::Options options = {}) {
  return [options](const Session& session, SessionGraph graph, TreePlace place) {
    ScriptedSolver::Options of_session = options;
    of_session.max_rounds = session.max_rounds;
    return std::make_unique<ScriptedSolver>(std::move(graph), std::move(place), of_session);
  };
}

TeamProblem ring(unsigned seed) {
  return random_team_problem({.robots = kIds, .pairs = kRing, .keyframes = 12}, seed);
}

void check_optimum(const TeamNetwork& network, const TeamProblem& problem) {
  for (const auto& [id, robot] : network.robots) {
    CAPTURE(id);
    REQUIRE(robot.trajectory);
    CHECK(robot.trajectory->anchor == problem.start.begin()->first);
  }
  check_cost(network, problem);
}

}  // namespace

TEST_CASE("one robot alone solves its own graph") {
  const TeamProblem problem = random_team_problem({.robots = {4}, .keyframes = 12}, 1);
  PoseGraphConfig config;
  config.robust = GENERATE(true, false);  // not robust: from chordal initialisation
  TeamNetwork network;
  feed(network.add({4, 1}, config, gather()), 4, problem);
  REQUIRE(settle(network, 5.0));
  check_optimum(network, problem);
  CHECK(network.robots.at(4).bytes == 0);
}

TEST_CASE("the frame at the end is the odometry frame of the lowest robot") {
  const TeamProblem problem = ring(2);
  PoseGraphConfig config;
  config.robust = GENERATE(true, false);
  TeamNetwork network;
  std::mt19937 rng(2);
  const SE3 T_odom_first = random_pose(rng, 3.0);
  for (const RobotId id : kIds) {
    TeamAgent& agent = network.add({id, 1}, config, gather());
    if (id == 7) {
      KeyframeOdometry first;
      first.id = {7, 0};
      first.T_odom_kf = first.T_previous_kf = T_odom_first;
      CHECK(agent.add(first));
    }
    feed(agent, id, problem);
  }
  REQUIRE(settle(network));
  check_optimum(network, problem);
  CHECK(network.robots.at(7).trajectory->T_world_kf[0].isApprox(T_odom_first, 1e-6));
}

TEST_CASE("a robot that resumes, or restarts without its data, takes part again") {
  const RobotId back = GENERATE(RobotId{7}, RobotId{50});
  const bool chain = GENERATE(true, false);
  const bool resumes = GENERATE(true, false);
  CAPTURE(back, chain, resumes);
  const TeamProblem problem = ring(9);
  const std::uint64_t boot = 1U << kResumeBits;
  TeamNetwork network;
  for (const RobotId id : kIds) feed(network.add({id, boot}, {}, gather()), id, problem);
  if (chain) network.wire({{7, 33}, {33, 50}, {50, 1200}});
  REQUIRE(settle(network));
  network.kill(back);
  (void)network.run(1.0);
  const std::uint64_t next = resumes ? next_boot(boot) : 2U << kResumeBits;
  feed(network.add({back, next}, {}, gather()), back, problem);
  (void)network.run(2.0 * SpreadStates::kMeeting_s);  // all robots know the new process
  if (!resumes)                                       // closures to it are found again
    for (const RobotId id : kIds) feed_closures(network.agent(id), id, problem, 3);
  (void)network.run(1.0);
  REQUIRE(settle(network));
  check_optimum(network, problem);
}

TEST_CASE("a robot resumed without its team continues from the last solution") {
  const RobotId resumed = GENERATE(RobotId{33}, RobotId{1200});
  CAPTURE(resumed);
  const TeamProblem problem = ring(9);
  const std::uint64_t boot = 1U << kResumeBits;
  TeamNetwork network;
  for (const RobotId id : kIds) feed(network.add({id, boot}, {}, gather()), id, problem);
  REQUIRE(settle(network));
  TeamSolution solution;
  solution.trajectory = *network.robots.at(resumed).trajectory;
  solution.verdicts = network.robots.at(resumed).verdicts;
  for (const RobotId id : kIds)
    if (id != resumed) solution.peers.push_back({id, boot});
  TeamNetwork alone;
  TeamAgent& agent = alone.add({resumed, next_boot(boot)}, {}, gather());
  agent.restore(solution);
  feed(agent, resumed, problem);
  REQUIRE(settle(alone));
  const auto& after = alone.robots.at(resumed).trajectory;
  REQUIRE(after);
  CHECK(after->anchor == 7);
  REQUIRE(after->T_world_kf.size() == solution.trajectory.T_world_kf.size());
  constexpr double kSame = 1e-4;  // held poses are in single precision
  for (std::size_t k = 0; k < after->T_world_kf.size(); ++k) {
    const SE3& before = solution.trajectory.T_world_kf[k];
    CHECK((after->T_world_kf[k].matrix() - before.matrix()).norm() < kSame);
  }
  REQUIRE(after->public_poses.size() == solution.trajectory.public_poses.size());
  CHECK_FALSE(after->public_poses.empty());
  for (const auto& [id, T] : after->public_poses)
    CHECK((T.matrix() - solution.trajectory.public_poses.at(id).matrix()).norm() < kSame);
}

TEST_CASE("decisions on closures are valid for both robots") {
  TeamProblem problem = ring(4);
  PoseEdge wrong = problem.edges.back();
  wrong.from = {7, 3};
  wrong.to = {33, 8};
  wrong.T_from_to = make_pose(Eigen::Matrix3d::Identity(), {0.0, 30.0, 0.0});
  problem.edges.push_back(wrong);
  PoseGraphConfig config;
  config.exchange_budget_kb_s = 1e6;
  TeamNetwork network;
  add_all(network, problem, gather({.rejects = {wrong.id()}}), config);
  REQUIRE(settle(network));
  for (const RobotId id : {RobotId{7}, RobotId{33}}) {
    CAPTURE(id);
    REQUIRE(network.agent(id).decided().contains(wrong.id()));
    CHECK_FALSE(network.agent(id).decided().at(wrong.id()));
    CHECK(network.robots.at(id).verdicts.rejected() > 0);
  }
  CHECK_FALSE(network.agent(50).decided().contains(wrong.id()));
}

TEST_CASE("a graph that cannot be solved ends the session for all, with a notice") {
  const bool throws = GENERATE(true, false);
  CAPTURE(throws);
  const ScriptedSolver::Options options = throws ? ScriptedSolver::Options{.fails_in_round = 4}
                                                 : ScriptedSolver::Options{.gives_up_in_round = 4};
  const TeamProblem problem = ring(5);
  TeamNetwork network;
  for (const RobotId id : kIds)
    feed(network.add({id, 1}, {}, id == 50 ? gather(options) : gather()), id, problem);
  (void)network.run(60.0);
  CHECK(has_notice(network, 50, "cannot be solved"));
  for (const RobotId id : kIds) {
    CAPTURE(id);
    CHECK_FALSE(network.agent(id).in_session());
    CHECK(network.robots.at(id).trajectory->anchor == id);  // the result of the robot alone
  }
  CHECK(network.agent(7).part()->session().id.number < 5);  // without endless repetition
}

// The session of the message; nullopt for statuses.
std::optional<SessionId> session_of(const TeamMessage& message) {
  return std::visit(
      [](const auto& m) -> std::optional<SessionId> {
        if constexpr (requires { m.session; })
          return m.session;
        else if constexpr (requires { m.id; })
          return m.id;
        else
          return std::nullopt;
      },
      message);
}

TEST_CASE("the member that has sent most determines the wait for the next session") {
  constexpr double kBudget_kb_s = 5.0;
  std::vector<std::pair<RobotId, RobotId>> pairs(8, {33, 50});
  pairs.emplace_back(7, 33);
  const TeamProblem problem =
      random_team_problem({.robots = {7, 33, 50}, .pairs = pairs, .keyframes = 40}, 15);
  PoseGraphConfig config;
  config.exchange_budget_kb_s = kBudget_kb_s;
  config.session_wait_s = 600.0;
  TeamNetwork network;
  std::map<std::optional<SessionId>, std::map<RobotId, double>> sent_in;
  network.on_packet = [&](RobotId from, const LinkPacket& packet) {
    sent_in[session_of(*packet.message)][from] +=
        static_cast<double>(encode(*packet.message).size());
  };
  add_all(network, problem, gather(), config);
  network.wire({{7, 33}, {33, 50}});
  REQUIRE(settle(network));
  const double first_s = network.now_s();
  const SessionId first = network.agent(7).part()->session().id;
  std::map<RobotId, double>& sent = sent_in.at(first);
  // Robot 50 has many closures, the coordinator few.
  REQUIRE(sent.at(50) > 2.0 * sent.at(7));
  REQUIRE(sent.at(50) > sent.at(33));
  const double price_s = sent.at(50) / (1e3 * kBudget_kb_s);
  for (const RobotId id : {RobotId{7}, RobotId{33}})
    (void)network.agent(id).add(inlier_set(problem, 7, 33, 2));
  REQUIRE(network.run(600.0, [&] { return network.agent(7).part()->session().id != first; }));
  const double waited_s = network.now_s() - first_s;
  CAPTURE(sent.at(7), sent.at(50), waited_s);
  CHECK(waited_s > 0.9 * price_s);
  CHECK(waited_s < 1.1 * price_s + 2.0);
}

TEST_CASE("early stopping ends a session after the given rounds") {
  const TeamProblem problem = ring(10);
  PoseGraphConfig config;
  config.max_rounds = 2;
  TeamNetwork network;
  add_all(network, problem, gather(), config);
  REQUIRE(settle(network));
  for (const RobotId id : kIds) CHECK(network.agent(id).part()->progress().round == 2);
}

TEST_CASE("robots with different methods optimise separately, with a notice") {
  const TeamProblem problem = ring(13);
  TeamNetwork network;
  for (const RobotId id : kIds) {
    PoseGraphConfig config;
    if (id == 33) config.method = PgoMethod::kRbcd;
    feed(network.add({id, 1}, config, gather()), id, problem);
  }
  REQUIRE(network.run(60.0, [&] {
    return network.robots.at(33).progress.settled && network.robots.at(7).progress.settled &&
           network.robots.at(7).progress.members.size() == 3;
  }));
  CHECK(network.robots.at(33).progress.members == std::vector<RobotId>{33});
  CHECK(has_notice(network, 7, "another method"));
}

TEST_CASE("refused inputs are counted, with a notice") {
  TeamAgent agent({}, {7, 1}, gather());
  KeyframeOdometry keyframe;
  keyframe.id = {7, 5};
  CHECK_FALSE(agent.add(keyframe));
  Closure closure;
  closure.from.id = {7, 0};
  closure.to.id = {33, 0};
  closure.covariance.setZero();
  CHECK_FALSE(agent.add(closure));
  closure.from.id = {50, 0};
  CHECK_FALSE(agent.add(closure));  // between other robots: no notice
  InlierSet set{7, 33, 1, {closure_id({7, 0}, {50, 0})}};
  CHECK_FALSE(agent.add(set));
  CHECK(agent.refused().size() == 3);
  const TeamOutput output = agent.step(0.0, 0);
  CHECK(output.notices.size() == 3);
  CHECK_FALSE(agent.add(keyframe));
  CHECK(agent.step(0.1, 0).notices.size() == 1);
  CHECK_FALSE(agent.add(keyframe));
  CHECK(agent.step(0.2, 0).notices.empty());  // third refusal
}

TEST_CASE("false messages are refused or do no lasting harm") {
  const unsigned seed = GENERATE(range(1U, 7U));
  CAPTURE(seed);
  std::mt19937 rng(seed);
  const TeamProblem problem = ring(11);
  TeamNetwork network(seed);
  network.links.max_delay_s = 0.01;
  add_all(network, problem, gather());
  std::uniform_int_distribution<std::uint32_t> any(0, 20);
  const auto robot = [&] {
    const std::vector<RobotId> robots{7, 33, 50, 1200, 666, 667};
    return robots[any(rng) % robots.size()];
  };
  const auto peer = [&] { return TeamPeer{robot(), 1 + any(rng) / 12}; };
  TeamAgent& victim = network.agent(33);
  network.appear(33, {666, 1});
  for (int k = 0; k < 400; ++k) {
    TeamStatus status{.sender = {666, 1}};
    status.offers = {{robot(), any(rng) + 1, {any(rng), any(rng)}}};
    network.inject({666, 1}, 33, status, any(rng));

    Session session{.id = {peer(), any(rng)},
                    .plan = {.frame = {peer(), any(rng)}, .members = {}, .pairs = {}}};
    if (session.id.coordinator.robot != 666 && session.id.coordinator.robot != 667)
      session.id.coordinator = {666, 1};  // otherwise it is identical to a true one
    for (std::uint32_t n = any(rng) % 5; n > 0; --n)
      session.plan.members.push_back({.peer = peer(), .parent = robot()});
    session.plan.members.push_back({.peer = {33, 1}});
    session.plan.pairs = {{33, 666, {1, any(rng)}}};
    session.finished = any(rng) > 15;
    session.round = any(rng);
    network.inject({666, 1}, 33, session, any(rng));

    MemberPoses poses{.sender = {666, 1}, .session = session.id};
    poses.stage = static_cast<MemberStage>(any(rng) % 4);
    poses.keyframes = {any(rng) % 2, any(rng)};
    poses.T_frame_kf.resize(any(rng) % 3);
    poses.verdicts = {{closure_id({7, 1}, {33, 2}), false}};
    network.inject({666, 1}, 33, poses, any(rng));

    ReliableMessage message{.sender = {}, .session = session.id, .number = any(rng), .bytes = {}};
    if (victim.part() != nullptr && any(rng) > 10) message.session = victim.part()->session().id;
    message.sender = {any(rng) > 10 ? RobotId{666} : RobotId{667}, 1};
    message.to = any(rng) > 5 ? RobotId{33} : robot();
    message.received = any(rng);
    message.bytes = std::make_shared<const std::vector<std::uint8_t>>(any(rng), std::uint8_t{7});
    network.inject({666, 1}, 33, message);
    (void)network.run(0.003);
  }
  network.disappear(33, 666);
  (void)network.run(5.0);
  REQUIRE(settle(network, 120.0));
  check_optimum(network, problem);
}

TEST_CASE("verdicts on unknown closures, or from robots outside the session, decide nothing") {
  const TeamProblem problem = ring(11);
  TeamNetwork network;
  add_all(network, problem, gather());
  REQUIRE(settle(network));
  (void)network.run(1.0);
  const TeamAgent& victim = network.agent(7);
  const std::map<ClosureId, bool> decided = victim.decided();
  const std::size_t verdicts = network.robots.at(7).verdicts.closures.size();
  const double last_activity_s = victim.part()->cost().last_activity_s;
  const auto known = std::find_if(decided.begin(), decided.end(), [](const auto& closure) {
    return closure.first.from.robot == 7 && closure.first.to.robot == 33;
  });
  REQUIRE(known != decided.end());
  for (std::uint32_t k = 1; k < 10; ++k) {
    MemberPoses poses{.sender = {666, 1},
                      .session = victim.part()->session().id,
                      .stage = MemberStage::kSolved,
                      .keyframes = {0}};
    poses.T_frame_kf.resize(1);
    poses.verdicts = {{closure_id({7, k}, {666, k}), false}};
    network.inject({33, 1}, 7, poses);
    poses.sender = {33, 1};
    poses.verdicts = {{known->first, known->second}, {closure_id({7, 1000 + k}, {33, k}), false}};
    network.inject({33, 1}, 7, poses);
    (void)network.run(0.1);
  }
  CHECK(victim.decided() == decided);
  CHECK(network.robots.at(7).verdicts.closures.size() == verdicts);
  CHECK(victim.part()->cost().last_activity_s == last_activity_s);  // the session is over
}

TEST_CASE("a session with unknown closures is refused") {
  const TeamProblem problem = ring(11);
  TeamNetwork network;
  add_all(network, problem, gather());
  REQUIRE(settle(network));
  const TeamAgent& agent = network.agent(33);
  const Session running = agent.part()->session();
  Session made_up = running;
  ++made_up.id.number;
  made_up.finished = false;
  for (SessionPair& pair : made_up.plan.pairs) pair.edges.hash ^= 1U;
  CHECK(agent.refused().empty());
  network.inject({7, 1}, 33, made_up);
  CHECK(agent.refused().size() == 1);
  CHECK(agent.part()->session().id == running.id);
}

TEST_CASE("every message may arrive late, twice and in any order") {
  const unsigned seed = GENERATE(1U, 2U, 3U);
  CAPTURE(seed);
  const TeamProblem problem = ring(seed);
  TeamNetwork network(seed);
  network.links = {.max_delay_s = 0.3, .lost = 0.05, .duplicated = 0.5};
  std::vector<std::pair<RobotId, LinkPacket>> seen;
  network.on_packet = [&](RobotId from, const LinkPacket& packet) {
    seen.emplace_back(from, packet);
  };
  add_all(network, problem, gather());
  std::mt19937 rng(seed);
  for (int k = 0; k < 200; ++k) {
    (void)network.run(0.01);
    if (seen.empty()) continue;
    const auto& [from, packet] = seen[rng() % seen.size()];  // an old message
    network.inject({from, 1}, packet.next, *packet.message, packet.number);
  }
  REQUIRE(settle(network));
  for (int k = 0; k < 100; ++k) {
    const auto& [from, packet] = seen[rng() % seen.size()];
    network.inject({from, 1}, packet.next, *packet.message, packet.number);
  }
  (void)network.run(5.0);
  REQUIRE(settle(network));
  check_optimum(network, problem);
}

}  // namespace km
