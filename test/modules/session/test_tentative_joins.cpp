#include "modules/rbcd/solver_choice.hpp"
#include "test/support/scripted_solver.hpp"
#include "test/support/team_network.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

using Robots = std::vector<RobotId>;

constexpr std::uint32_t kJoinKeyframes = 60;

// Three robots; closures at several places tie robots 4 and 6. The closures of 2 with 4
// are at these keyframes of robot 2.
TeamProblem team_of_three(unsigned seed, const std::set<std::uint32_t>& at) {
  TeamProblem problem = random_team_problem({.robots = {2, 4, 6},
                                             .pairs = {{4, 6}},
                                             .keyframes = kJoinKeyframes,
                                             .closures = 8,
                                             .start_sigma = 0.0},
                                            seed);
  std::mt19937 rng(seed);
  for (const std::uint32_t k : at) {
    const KeyframeId from{2, k}, to{4, kJoinKeyframes - 1 - k};
    const SE3 T = problem.start.at(2)[from.index].inverse() * problem.start.at(4)[to.index];
    const Vector6 noise = 0.02 * random_vector<6>(rng);
    problem.edges.push_back({from, to, T * se3_exp(noise), problem.edges.front().precision});
  }
  return problem;
}

// Closures of robots 2 and 4 at one place that is mistaken for another. Places that are mistaken in
// the same way have the same seed.
std::set<ClosureId> add_false(TeamProblem& problem, std::uint32_t first, std::uint32_t count,
                              std::optional<unsigned> seed = std::nullopt) {
  std::set<ClosureId> added;
  std::mt19937 rng(seed.value_or(first));
  const SE3 off = random_pose(rng, 20.0);
  for (std::uint32_t k = first; k < first + count; ++k) {
    const KeyframeId from{2, k}, to{4, k};
    const SE3 T = problem.start.at(2)[k].inverse() * off * problem.start.at(4)[k];
    problem.edges.push_back({from, to, T, problem.edges.front().precision});
    added.insert(problem.edges.back().id());
  }
  return added;
}

const OptimizerProgress& progress_of(const TeamNetwork& network, RobotId robot) {
  return network.robots.at(robot).progress;
}

// Gives the closures `later`, then the set, to both robots of the set.
void add_later(TeamNetwork& network, const TeamProblem& problem, const std::set<ClosureId>& later,
               const InlierSet& set) {
  for (const RobotId robot : {set.a, set.b}) {
    for (const PoseEdge& e : problem.edges)
      if (later.contains(e.id())) (void)network.agent(robot).add(closure_of(e, &problem));
    (void)network.agent(robot).add(set);
  }
}

bool settle_and_report(TeamNetwork& network) {
  const bool settled = settle(network);
  (void)network.run(5.0);
  return settled;
}

}  // namespace

TEST_CASE("Robots that closures at one place join are tentative, and report it") {
  const std::uint32_t count = GENERATE(1U, 5U);  // closures at this place
  CAPTURE(count);
  std::set<std::uint32_t> at;
  for (std::uint32_t k = 0; k < count; ++k) at.insert(10 + k);
  const TeamProblem problem = team_of_three(1, at);
  TeamNetwork network;
  add_all(network, problem, solver_choice({}));
  REQUIRE(settle_and_report(network));
  CHECK(progress_of(network, 2).tentative == Robots{4, 6});
  CHECK(progress_of(network, 4).tentative == Robots{2});
  CHECK(progress_of(network, 6).tentative == Robots{2});
  for (const RobotId robot : {RobotId{2}, RobotId{4}, RobotId{6}}) {
    CHECK(progress_of(network, robot).not_joined.empty());
    CHECK(progress_of(network, robot).anchor == 2);
    CHECK(has_notice(network, robot,
                     robot == 2 ? "joined tentatively with robots 4, 6, by"
                                : "joined tentatively with robot 2, by"));
  }
}

TEST_CASE("Robots that share one way are certain unless a closure between them is rejected") {
  const bool contradicted = GENERATE(false, true);
  std::set<std::uint32_t> at;
  for (std::uint32_t k = 5; k < 30; k += 2) at.insert(k);
  TeamProblem problem = team_of_three(1, at);
  if (contradicted) (void)add_false(problem, 38, 1);
  TeamNetwork network;
  add_all(network, problem, solver_choice({}));
  REQUIRE(settle_and_report(network));
  CHECK(progress_of(network, 2).tentative == (contradicted ? Robots{4, 6} : Robots{}));
}

TEST_CASE(
    "A place that is mistaken for another joins robots tentatively until two others correct it") {
  const unsigned seed = GENERATE(range(1U, 7U));
  const std::uint32_t count = GENERATE(1U, 3U);
  CAPTURE(seed, count);
  TeamProblem all = team_of_three(seed, {8, 9, 30, 31, 50});
  const std::set<ClosureId> wrong = add_false(all, 20, count);
  std::set<ClosureId> later;
  for (const PoseEdge& e : all.edges)
    if (e.from.robot == 2 && e.to.robot == 4 && !wrong.contains(e.id())) later.insert(e.id());
  TeamNetwork network(seed);
  add_all(network, without(all, later), solver_choice({}));
  REQUIRE(settle_and_report(network));
  CHECK(progress_of(network, 2).tentative == Robots{4, 6});

  add_later(network, all, later, inlier_set(all, 2, 4, 2));
  const std::uint32_t sessions = network.agent(2).part()->session().id.number;
  (void)network.run(1.0);
  REQUIRE(settle(network));
  CHECK(network.agent(2).part()->session().id.number == sessions + 1);
  (void)network.run(5.0);
  for (const ClosureId& id : wrong) CHECK_FALSE(network.agent(2).decided().at(id));
  for (const ClosureId& id : later) CHECK(network.agent(2).decided().at(id));
  for (const RobotId robot : {RobotId{2}, RobotId{4}, RobotId{6}})
    CHECK(progress_of(network, robot).tentative.empty());
  CHECK(network.robots.at(2).news ==
        std::vector<std::string>{"no longer joined tentatively, but by closures at several places: "
                                 "with robots 4, 6"});
  check_cost(network, without(all, wrong));
}

TEST_CASE("Robots with two single closures that contradict each other are not joined") {
  const unsigned seed = GENERATE(range(1U, 7U));
  CAPTURE(seed);
  TeamProblem problem = team_of_three(seed, {8});
  (void)add_false(problem, 40, 1);
  TeamNetwork network(seed);
  add_all(network, problem, solver_choice({}));
  REQUIRE(settle_and_report(network));
  CHECK(progress_of(network, 2).not_joined == Robots{4, 6});
  CHECK(progress_of(network, 4).not_joined == Robots{2});
  CHECK(progress_of(network, 4).anchor == 4);
  CHECK(progress_of(network, 4).tentative.empty());
}

TEST_CASE("Robots are not joined if as many places agree on another relative pose") {
  const unsigned seed = GENERATE(range(1U, 7U));
  const bool alike = GENERATE(true, false);  // the false places agree with each other
  CAPTURE(seed, alike);
  TeamProblem problem = team_of_three(seed, {8, 9, 22, 23, 24});
  for (const std::uint32_t first : {35U, 52U})
    (void)add_false(problem, first, 2, alike ? std::optional(seed) : std::nullopt);
  TeamNetwork network(seed);
  add_all(network, problem, solver_choice({}));
  REQUIRE(settle_and_report(network));
  CHECK(progress_of(network, 2).tentative.empty());
  CHECK(progress_of(network, 2).not_joined == (alike ? Robots{4, 6} : Robots{}));
  CHECK(progress_of(network, 4).not_joined == (alike ? Robots{2} : Robots{}));
  CHECK(progress_of(network, 4).anchor == (alike ? 4 : 2));
}

TEST_CASE("Robots whose closures are all rejected publish in two frames, until others join them") {
  const TeamProblem problem = team_of_three(3, {8, 9, 30, 31, 40, 50});
  std::set<ClosureId> later;  // at three places
  for (const PoseEdge& e : problem.edges)
    if (e.from.robot == 2 && e.to.robot == 4 && e.from.index >= 30) later.insert(e.id());
  bool rejects = true;
  const MemberSolverFactory factory = [&](const Session&, SessionGraph graph, TreePlace place) {
    ScriptedSolver::Options options;
    if (rejects)
      for (const PoseEdge& e : graph.between)
        if (std::min(e.from.robot, e.to.robot) == 2) options.rejects.insert(e.id());
    return std::make_unique<ScriptedSolver>(std::move(graph), std::move(place), options);
  };
  TeamNetwork network;
  add_all(network, without(problem, later), factory);
  REQUIRE(settle_and_report(network));
  CHECK(progress_of(network, 2).not_joined == Robots{4, 6});
  CHECK(progress_of(network, 4).not_joined == Robots{2});
  CHECK(progress_of(network, 2).anchor == 2);
  for (const RobotId robot : {RobotId{4}, RobotId{6}}) {
    CHECK(progress_of(network, robot).anchor == 4);
    CHECK(network.robots.at(robot).trajectory->anchor == 4);
    CHECK(has_notice(network, robot, "no accepted closure"));
  }
  // The frame of an anchor is that of its odometry.
  CHECK(network.robots.at(4).trajectory->T_world_kf.front().isApprox(SE3::Identity(), 1e-6));

  // Closures that no session has weighed do not move robot 4 into the frame in which those before
  // were rejected.
  std::set<RobotId> anchors;
  network.on_step = [&](const TeamNetwork::Robot& robot) {
    if (robot.peer.robot != 2 && !network.agent(4).in_session())
      anchors.insert(robot.trajectory->anchor);
  };
  // Pairwise consistency may prefer them to those before.
  const bool instead = GENERATE(true, false);
  CAPTURE(instead);
  InlierSet selected = inlier_set(problem, 2, 4, 2);
  if (instead) selected.closures.assign(later.begin(), later.end());
  add_later(network, problem, later, selected);
  (void)network.run(1.0);  // the next session waits for two seconds at rest
  CHECK_FALSE(network.agent(2).in_session());
  CHECK(progress_of(network, 4).not_joined == Robots{2});
  REQUIRE(settle(network));
  CHECK(anchors == std::set<RobotId>{4});
  network.on_step = {};

  network.kill(2);
  (void)network.run(10.0);
  REQUIRE(settle_and_report(network));
  for (const RobotId robot : {RobotId{4}, RobotId{6}})
    CHECK(network.robots.at(robot).trajectory->anchor == 4);  // still not that of robot 2
  network.revive(2);

  rejects = false;
  add_later(network, problem, {}, inlier_set(problem, 2, 4, 3));
  (void)network.run(1.0);
  REQUIRE(settle_and_report(network));
  for (const RobotId robot : {RobotId{2}, RobotId{4}, RobotId{6}}) {
    CHECK(progress_of(network, robot).not_joined.empty());
    CHECK(progress_of(network, robot).anchor == 2);
    CHECK(network.robots.at(robot).trajectory->anchor == 2);
  }
}

TEST_CASE(
    "A robot whose closures are all rejected is not joined by a pair that no session has seen") {
  TeamProblem problem = team_of_three(3, {8, 9});
  std::set<ClosureId> later;  // the first ones of robots 2 and 6, at three places
  for (const std::uint32_t k : {30U, 40U, 50U}) {
    const KeyframeId from{2, k}, to{6, k};
    const SE3 T = problem.start.at(2)[k].inverse() * problem.start.at(6)[k];
    problem.edges.push_back({from, to, T, problem.edges.front().precision});
    later.insert(problem.edges.back().id());
  }
  bool rejects = true;
  const MemberSolverFactory factory = [&](const Session&, SessionGraph graph, TreePlace place) {
    ScriptedSolver::Options options;
    for (const PoseEdge& e : graph.between)
      if (rejects && e.id().from.robot == 2 && e.id().to.robot == 4) options.rejects.insert(e.id());
    return std::make_unique<ScriptedSolver>(std::move(graph), std::move(place), options);
  };
  TeamNetwork network;
  add_all(network, without(problem, later), factory);
  REQUIRE(settle_and_report(network));
  REQUIRE(progress_of(network, 6).not_joined == Robots{2});

  add_later(network, problem, later, inlier_set(problem, 2, 6));
  (void)network.run(1.0);  // the next session waits for two seconds at rest
  REQUIRE_FALSE(network.agent(2).in_session());
  CHECK(progress_of(network, 2).not_joined == Robots{4, 6});
  CHECK(network.robots.at(2).trajectory->anchor == 2);
  for (const RobotId robot : {RobotId{4}, RobotId{6}}) {
    CHECK(progress_of(network, robot).not_joined == Robots{2});
    CHECK(network.robots.at(robot).trajectory->anchor == 4);
  }

  rejects = false;
  REQUIRE(settle_and_report(network));
  for (const RobotId robot : {RobotId{2}, RobotId{4}, RobotId{6}}) {
    CHECK(progress_of(network, robot).not_joined.empty());
    CHECK(network.robots.at(robot).trajectory->anchor == 2);
  }
}

}  // namespace km
