#include "modules/rbcd/solver_choice.hpp"
#include "test/support/scripted_solver.hpp"
#include "test/support/team_network.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

using Pairs = std::vector<std::pair<RobotId, RobotId>>;

const std::vector<RobotId> kFour{2, 3, 5, 9};
const Pairs kSquare{{2, 3}, {3, 5}, {5, 9}, {2, 9}};
constexpr std::uint32_t kSquareKeyframes = 20;

TeamProblem problem_of(unsigned seed) {
  return random_team_problem({.robots = kFour,
                              .pairs = kSquare,
                              .keyframes = kSquareKeyframes,
                              .closures = 10,
                              .start_sigma = 0.0},
                             seed);
}

std::size_t closures_of(const TeamProblem& problem) {
  return static_cast<std::size_t>(std::count_if(problem.edges.begin(), problem.edges.end(),
                                                [](const PoseEdge& e) { return !is_step(e); }));
}

// Adds false closures up to this share of all closures, between the robots of each pair and inside
// each robot.
std::set<ClosureId> add_random_false(TeamProblem& problem, double part, unsigned seed) {
  std::mt19937 rng(seed);
  std::set<ClosureId> known, added;
  for (const PoseEdge& e : problem.edges) known.insert(e.id());
  Pairs pairs = kSquare;
  for (const RobotId robot : kFour) pairs.emplace_back(robot, robot);
  const auto count =
      static_cast<std::size_t>(part / (1.0 - part) * static_cast<double>(closures_of(problem)));
  std::uniform_int_distribution<std::uint32_t> any(0, kSquareKeyframes - 1);
  while (added.size() < count) {
    const auto& [a, b] = pairs[added.size() % pairs.size()];
    const KeyframeId from{a, any(rng)};
    const KeyframeId to{b, any(rng)};
    if (from == to || !known.insert(closure_id(from, to)).second) continue;
    added.insert(closure_id(from, to));
    problem.edges.push_back({from, to, random_pose(rng, 5.0), problem.edges.back().precision});
  }
  return added;
}

// Consecutive false closures with one common error, as between places that look alike.
std::set<ClosureId> add_cluster(TeamProblem& problem, std::uint32_t count, unsigned seed) {
  std::mt19937 rng(seed);
  const SE3 off = random_pose(rng, 8.0);
  std::set<ClosureId> known, added;
  for (const PoseEdge& e : problem.edges) known.insert(e.id());
  for (std::uint32_t k = 0; k < count; ++k) {
    const KeyframeId from{2, 4 + k}, to{3, 9 + k};
    if (!known.insert(closure_id(from, to)).second) continue;
    const SE3 T = problem.start.at(2)[from.index].inverse() * off * problem.start.at(3)[to.index];
    const Vector6 noise = 0.02 * random_vector<6>(rng);
    problem.edges.push_back({from, to, T * se3_exp(noise), problem.edges.back().precision});
    added.insert(closure_id(from, to));
  }
  return added;
}

ClosureId first_between(const TeamProblem& problem, RobotId a, RobotId b) {
  for (const PoseEdge& e : problem.edges)
    if (e.id().from.robot == a && e.id().to.robot == b) return e.id();
  throw std::runtime_error("no closure between the robots");
}

std::set<ClosureId> rejected(const TeamNetwork& network) {
  std::set<ClosureId> closures;
  for (const auto& [id, robot] : network.robots)
    for (const auto& [closure, kept] : robot.agent->decided())
      if (!kept) closures.insert(closure);
  return closures;
}

void check_ends_agree(const TeamNetwork& network) {
  std::map<ClosureId, bool> decided;
  for (const auto& [id, robot] : network.robots)
    for (const auto& [closure, kept] : robot.agent->decided())
      CHECK(decided.try_emplace(closure, kept).first->second == kept);
}

}  // namespace

TEST_CASE("random false closures are rejected and leave the optimum of the true ones") {
  const unsigned seed = GENERATE(range(1U, 13U));
  CAPTURE(seed);
  TeamProblem problem = problem_of(seed);
  const std::set<ClosureId> wrong = add_random_false(problem, 0.3, seed);
  TeamNetwork network(seed);
  network.links = {.max_delay_s = 0.05, .lost = 0.05, .duplicated = 0.05};
  add_all(network, problem, solver_choice({}));
  network.wire({{2, 3}, {3, 5}, {5, 9}});
  REQUIRE(settle(network));
  CHECK(rejected(network) == wrong);
  check_ends_agree(network);
  check_cost(network, without(problem, wrong));
}

TEST_CASE("false closures that agree with each other are rejected if others contradict them") {
  const unsigned seed = GENERATE(range(1U, 5U));
  const std::uint32_t count = GENERATE(2U, 4U, 6U);
  CAPTURE(seed, count);
  TeamProblem problem = problem_of(seed);
  const std::set<ClosureId> wrong = add_cluster(problem, count, seed);
  TeamNetwork network(seed);
  network.links = {.max_delay_s = 0.05, .lost = 0.05};
  add_all(network, problem, solver_choice({}));
  REQUIRE(settle(network));
  CHECK(rejected(network) == wrong);
  check_ends_agree(network);
  check_cost(network, without(problem, wrong));
}

TEST_CASE("a wrong step of odometry is corrected, and closures are kept") {
  const unsigned seed = GENERATE(range(1U, 6U));
  CAPTURE(seed);
  TeamProblem problem = random_team_problem(
      {.robots = {2, 5}, .pairs = {{2, 5}}, .keyframes = 60, .closures = 60, .start_sigma = 0.0},
      seed);
  for (PoseEdge& e : problem.edges)
    if (is_step(e) && e.from == KeyframeId{2, 30})
      e.T_from_to = e.T_from_to * make_pose(so3_exp({0.0, 0.8, 1.6}), {5.0, -3.0, 1.0});
  TeamNetwork network(seed);
  add_all(network, problem, solver_choice({}));
  REQUIRE(settle(network));
  // The step is known up to the nearest ends of closures, so closures between may be rejected.
  CHECK(rejected(network).size() <= 3);
  CHECK(network.robots.at(2).progress.odometry_breaks == 1);
  CHECK(network.robots.at(5).progress.odometry_breaks == 0);
  CHECK(has_notice(network, 2, "odometry is wrong near keyframe"));
}

TEST_CASE("a session after new closures decides on all as a single session does") {
  const unsigned seed = GENERATE(range(1U, 6U));
  CAPTURE(seed);
  TeamProblem all = problem_of(seed);
  const std::set<ClosureId> wrong = add_random_false(all, 0.2, seed);
  std::set<ClosureId> later;  // true closures of one pair
  for (const PoseEdge& e : all.edges)
    if (e.id().from.robot == 3 && e.id().to.robot == 5 && later.size() < 3 &&
        !wrong.contains(e.id()))
      later.insert(e.id());
  REQUIRE(later.size() == 3);
  TeamNetwork network(seed);
  add_all(network, without(all, later), solver_choice({}));
  REQUIRE(settle(network));
  REQUIRE(rejected(network) == wrong);
  for (const RobotId robot : {RobotId{3}, RobotId{5}}) {
    for (const PoseEdge& e : all.edges)
      if (later.contains(e.id())) (void)network.agent(robot).add(closure_of(e));
    (void)network.agent(robot).add(inlier_set(all, 3, 5, 2));
  }
  (void)network.run(1.0);
  REQUIRE(settle(network));
  TeamNetwork single(seed);
  add_all(single, all, solver_choice({}));
  REQUIRE(settle(single));
  CHECK(rejected(network) == rejected(single));
  check_ends_agree(network);
  constexpr double kSame_m = 1e-9;
  for (const auto& [robot, poses] : single.trajectories())
    for (std::size_t k = 0; k < poses.size(); ++k)
      CHECK((network.trajectories().at(robot)[k].matrix() - poses[k].matrix()).norm() < kSame_m);
}

TEST_CASE("the second look of a session gets the decisions of the first, and decides") {
  const TeamProblem problem = problem_of(3);
  const ClosureId closure = first_between(problem, 5, 9);
  const bool fits = GENERATE(true, false);
  CAPTURE(fits);
  using Decision = std::optional<bool>;
  std::map<SessionId, std::vector<Decision>> looks;  // decision before each look of robots 5 and 9
  const MemberSolverFactory factory = [&](const Session& session, SessionGraph graph,
                                          TreePlace place) {
    ScriptedSolver::Options options{.barc = 3.0, .deferred = true};
    if (place.members.size() == kFour.size()) {
      const auto decided = graph.decided.find(closure);
      if (graph.self == 5 || graph.self == 9)
        looks[session.id].push_back(decided == graph.decided.end() ? Decision()
                                                                   : Decision(decided->second));
      CHECK(graph.first_barc == (graph.again ? options.barc : 0.0));
      if (graph.again && fits)
        graph.decided.erase(closure);
      else
        options.rejects = {closure};
    }
    return std::make_unique<ScriptedSolver>(std::move(graph), std::move(place), options);
  };
  TeamNetwork network;
  add_all(network, problem, factory);
  REQUIRE(settle(network));
  (void)network.run(30.0);
  REQUIRE(settle(network));
  REQUIRE(looks.size() == 1);
  CHECK(looks.begin()->second == std::vector<Decision>{{}, {}, false, false});
  for (const RobotId robot : {RobotId{5}, RobotId{9}})
    CHECK(network.agent(robot).decided().at(closure) == fits);
}

TEST_CASE("decisions that a team makes without a robot do not outlast its absence") {
  const TeamProblem problem = problem_of(3);
  const ClosureId closure = first_between(problem, 2, 3);
  const MemberSolverFactory factory = [&](const Session&, SessionGraph graph, TreePlace place) {
    ScriptedSolver::Options options;
    if (place.members.size() == 3 || graph.decided.contains(closure)) options.rejects = {closure};
    return std::make_unique<ScriptedSolver>(std::move(graph), std::move(place), options);
  };
  TeamNetwork network;
  add_all(network, problem, factory);
  REQUIRE(settle(network));
  const auto check_kept = [&](bool kept) {
    for (const RobotId robot : {RobotId{2}, RobotId{3}})
      CHECK(network.agent(robot).decided().at(closure) == kept);
  };
  check_kept(true);
  network.kill(9);
  KeyframeOdometry next;  // the next session waits for a measurement of a member
  next.id = {5, kSquareKeyframes};
  next.covariance = covariance_of(problem.edges.back().precision);
  REQUIRE(network.agent(5).add(next));
  (void)network.run(10.0);
  REQUIRE(settle(network));
  check_kept(false);
  network.revive(9);
  (void)network.run(1.0);
  REQUIRE(settle(network));
  check_kept(true);
  check_ends_agree(network);
}

TEST_CASE("closures to a robot out of reach that no session has kept move no robot") {
  TeamProblem problem = problem_of(3);
  TeamNetwork network;
  add_all(network, problem, solver_choice({}));
  REQUIRE(settle(network));
  network.kill(9);
  (void)network.run(10.0);
  REQUIRE(settle(network));
  const TeamPoses before = network.trajectories();

  const ClosureId held = first_between(problem, 5, 9);
  const KeyframeId theirs = held.from.robot == 9 ? held.from : held.to;
  std::mt19937 rng(1);
  const SE3 T_false = random_pose(rng, 5.0);
  const Precision precision = problem.edges.back().precision;
  std::set<ClosureId> known;
  for (const PoseEdge& e : problem.edges) known.insert(e.id());
  for (KeyframeIndex k = 0; k < kSquareKeyframes; ++k)
    if (const KeyframeId own{5, k}; known.insert(closure_id(own, theirs)).second)
      problem.edges.push_back({own, theirs, T_false, precision});
  for (const PoseEdge& e : problem.edges)
    if (!is_step(e) && std::minmax(e.from.robot, e.to.robot) == std::minmax<RobotId>(5, 9))
      (void)network.agent(5).add(closure_of(e, &problem));
  REQUIRE(network.agent(5).add(inlier_set(problem, 5, 9, 2)));
  KeyframeOdometry next;  // the next session waits for a measurement of a member
  next.id = {5, kSquareKeyframes};
  next.covariance = covariance_of(precision);
  REQUIRE(network.agent(5).add(next));
  (void)network.run(10.0);
  REQUIRE(settle(network));
  constexpr double kSame_m = 1e-6;
  for (const RobotId robot : {RobotId{2}, RobotId{3}, RobotId{5}})
    for (std::size_t k = 0; k < kSquareKeyframes; ++k)
      CHECK((network.trajectories().at(robot)[k].translation() - before.at(robot)[k].translation())
                .norm() < kSame_m);
}

}  // namespace km
