#include "modules/robust/tree_newton.hpp"
#include "test/support/solver_team.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

constexpr double kRelativeGap = 1e-9;  // relative to the cost

auto newton(TreeNewtonOptions options) {
  return [options](SessionGraph graph, TreePlace place) {
    return std::make_unique<TreeNewton>(std::move(graph), std::move(place), options);
  };
}

const TreeNewtonOptions kTrusting{.robust = false};

TEST_CASE("A team finds the optimum of its graph with any tree") {
  const unsigned seed = GENERATE(1U, 2U);
  const double tilt_sigma = GENERATE(0.0, 0.01);  // noise of verticals
  const bool is_held = GENERATE(false, true);     // an absent robot holds the frame
  CAPTURE(seed, tilt_sigma, is_held);
  TeamProblem problem = random_team_problem({.robots = {0, 2, 5, 7},
                                             .pairs = {{0, 2}, {2, 5}, {5, 7}, {0, 7}, {0, 5}},
                                             .tilt_sigma = tilt_sigma},
                                            seed);
  if (is_held) problem.absent = {2};
  const CentralProblem central(problem);
  const double optimum = central.optimum(problem.start);
  const auto trees = {star(problem.members()), star(problem.members(), 2),
                      chain(problem.members())};
  for (const TeamTree& tree : trees) {
    SolverTeam team = solver_team(problem, tree, {}, newton(kTrusting));
    REQUIRE(team.run());
    CHECK(team.refused() == 0);
    CHECK(central.cost(team.poses()) == Approx(optimum).epsilon(kRelativeGap));
    CHECK(team.member(0).state().cost == Approx(optimum).epsilon(kRelativeGap));
  }
}

TEST_CASE("Late, duplicate and reordered messages change nothing") {
  const TeamProblem problem =
      random_team_problem({.robots = {0, 2, 5, 7}, .pairs = {{0, 2}, {2, 5}, {5, 7}, {0, 7}}}, 3);
  SolverTeam team = solver_team(problem, chain(problem.members()), {}, newton({}));
  SolverTeam late = solver_team(problem, chain(problem.members()),
                                {.max_delay = 5, .duplicated = 0.3}, newton({}));
  REQUIRE(team.run());
  REQUIRE(late.run());
  for (const auto& [robot, poses] : team.poses())
    for (std::size_t k = 0; k < poses.size(); ++k)
      CHECK(late.poses().at(robot)[k].matrix() == poses[k].matrix());
}

TEST_CASE("Weights of closures to the parent change no second derivatives of the child") {
  TeamProblem problem =
      random_team_problem({.robots = {0, 2}, .pairs = {{0, 2}}, .closures = 20}, 5);
  int false_closures = 0;
  for (PoseEdge& e : problem.edges)
    if (e.from.robot == e.to.robot)
      problem.decided[e.id()] = true;
    else if (++false_closures <= 5)
      e.T_from_to.translation().x() += 10.0;
  const std::size_t root = GENERATE(0U, 1U);
  SolverTeam team = solver_team(problem, star(problem.members(), root), {}, newton({}));
  int messages = 0, systems = 0;
  team.on_sent = [&](RobotId, std::span<const std::uint8_t> bytes) {
    const auto up = decode_up(bytes);
    messages += up ? 1 : 0;
    systems += up && up->system ? 1 : 0;
  };
  REQUIRE(team.run());
  int kept = 0;
  for (const RobotId robot : problem.members())
    for (const WeighedClosure& closure : team.member(robot).verdicts().closures)
      kept += closure.id.from.robot != closure.id.to.robot && closure.kept ? 1 : 0;
  CHECK(kept >= 12);
  CHECK(kept <= 15);
  CHECK(messages > 6);  // steps with weights that change
  CHECK(systems <= 3);  // at the start, if a step is undone, and full ones at the end
}

TEST_CASE("Impossible verdicts are refused, and the true one is accepted afterwards") {
  using Next = TreeVerdict::Next;
  const TeamProblem problem = random_team_problem({.robots = {1, 2}, .pairs = {{1, 2}}}, 6);
  const TeamTree tree = star(problem.members());
  TreeNewton root(session_graph(problem, 1), tree.at(1), kTrusting);
  TreeNewton leaf(session_graph(problem, 2), tree.at(2), kTrusting);
  const auto accepts = [&](std::uint32_t round, Next next, Eigen::Index size = 0) {
    DownMessage message{.verdict = {.round = round, .next = next}};
    message.step = Eigen::VectorXd::Constant(size, 1e-3);
    return leaf.receive(1, encode(message));
  };
  const auto carry_up = [&] {
    while (leaf.ready())
      for (const SolverMessage& message : leaf.advance()) CHECK(root.receive(2, *message.bytes));
  };
  CHECK_FALSE(accepts(0, Next::kStart));  // no message up was sent
  carry_up();
  CHECK_FALSE(accepts(1, Next::kStart));
  for (const Next next : {Next::kStep, Next::kShorten, Next::kRefresh, Next::kDone})
    CHECK_FALSE(accepts(0, next));  // the solver has not begun
  CHECK_FALSE(leaf.ready());
  for (std::uint32_t round = 0; round < 100 && !leaf.done(); ++round) {
    for (const SolverMessage& message : root.advance()) {
      const auto up = encode(UpMessage{.round = round + 2, .sums = {}});
      if (!root.done()) CHECK_FALSE(root.receive(2, up));  // no robot is this far
      CHECK(leaf.receive(1, *message.bytes));
      CHECK(leaf.receive(1, *message.bytes));
    }
    carry_up();
    if (leaf.done()) break;
    CHECK(accepts(round, Next::kStop));  // an old verdict
    if (round == 0) CHECK_FALSE(accepts(1, Next::kShorten));
    CHECK_FALSE(accepts(round + 1, Next::kStart));
    CHECK_FALSE(accepts(round + 1, Next::kCount));
    CHECK_FALSE(accepts(round + 1, Next::kStep, 1));
    CHECK_FALSE(leaf.ready());
  }
  const CentralProblem central(problem);
  const TeamPoses poses{{1, root.poses()}, {2, leaf.poses()}};
  CHECK(central.cost(poses) == Approx(central.optimum(problem.start)).epsilon(kRelativeGap));
}

TEST_CASE("A system before the start, or with other couplings later, stops no robot") {
  const TeamProblem problem = random_team_problem({.robots = {1, 2}, .pairs = {{1, 2}}}, 6);
  const TeamTree tree = star(problem.members());
  const TreeNewtonOptions options{.max_rounds = 20, .robust = false};
  TreeNewton root(session_graph(problem, 1), tree.at(1), options);
  TreeNewton leaf(session_graph(problem, 2), tree.at(2), options);
  std::optional<TreeSystem> sent = TreeSystem{.schur = BlockMatrix::zero(6, 0, 0)};
  for (int round = 0; round < 100 && !root.done(); ++round) {
    while (leaf.ready())
      for (const SolverMessage& message : leaf.advance()) {
        UpMessage up = *decode_up(*message.bytes);
        if (up.system) {
          sent = up.system;
          sent->pairs.clear();
          sent->edges.clear();
          sent->schur.coupling.resize(6, 0);
        } else {
          up.system = sent;
          up.weights.clear();
        }
        REQUIRE(root.receive(2, encode(up)));
      }
    for (const SolverMessage& message : root.advance()) REQUIRE(leaf.receive(1, *message.bytes));
  }
  CHECK(root.done());
}

}  // namespace
}  // namespace km
