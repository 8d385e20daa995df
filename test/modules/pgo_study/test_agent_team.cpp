#include <algorithm>
#include <catch2/catch.hpp>
#include <random>
#include <set>
#include <utility>

#include "modules/pgo_study/agent_team.hpp"
#include "modules/pgo_study/central_solver.hpp"
#include "modules/pose_graph/chordal.hpp"
#include "modules/pose_graph/rounding.hpp"
#include "test/support/team_graphs.hpp"

namespace km {
namespace {

constexpr double kNoise = 0.01;

// Three robots that closures alone join.
TeamGraph team_of_three(unsigned seed) {
  std::mt19937 rng(seed);
  TeamGraph graph = noisy_chain(90, 3, kNoise, rng);
  std::set<std::pair<Eigen::Index, Eigen::Index>> known;  // a pair of poses counts once
  std::erase_if(graph.edges,
                [&](const BlockEdge& e) { return !known.insert(std::minmax(e.i, e.j)).second; });
  for (BlockEdge& e : graph.edges) {
    e.kappa = 0.5 / (kNoise * kNoise);
    e.tau = 1.0 / (kNoise * kNoise);
  }
  return without_cut_steps(std::move(graph));
}

bool is_between(const TeamGraph& graph, const BlockEdge& e) {
  return graph.robot_of(e.i) != graph.robot_of(e.j);
}

TEST_CASE("Robots without steps between them hang together by closures alone", "[agent_team]") {
  TeamGraph graph = team_of_three(1);
  for (const BlockEdge& e : graph.edges) CHECK((e.j != e.i + 1 || !is_between(graph, e)));
  CHECK(std::ranges::count(part_of_poses(graph), 0) == 90);
  std::erase_if(graph.edges, [&](const BlockEdge& e) { return is_between(graph, e); });
  const std::vector<Eigen::Index> parts = part_of_poses(graph);
  for (Eigen::Index i = 0; i < 90; ++i) CHECK(parts[static_cast<std::size_t>(i)] == i / 30 * 30);
}

TEST_CASE("Robots' own code publishes the optimum of a graph", "[agent_team]") {
  const unsigned seed = GENERATE(1U, 2U);
  const double keyframes_per_s = GENERATE(0.0, 5.0);
  CAPTURE(seed, keyframes_per_s);
  const TeamGraph graph = team_of_three(seed);
  const AgentTeamRun run = run_agent_team(graph, {.keyframes_per_s = keyframes_per_s});
  CHECK(run.settled);
  CHECK(run.bytes > 1000);
  CHECK(run.world_of == std::vector<RobotId>{0, 0, 0});
  CHECK(std::ranges::count(run.kept, false) == 0);
  CentralSolver central(graph.edges, lift(chordal_initialisation(graph.poses(), graph.edges), 3),
                        3);
  while (central.step()) {
  }
  const std::vector<SE3> optimum = round_to_poses(central.X(), central.X().leftCols<4>());
  REQUIRE(run.T_world_kf.size() == optimum.size());
  const SE3 T = run.T_world_kf.front();
  for (std::size_t i = 0; i < optimum.size(); ++i)
    CHECK((run.T_world_kf[i].translation() - T * optimum[i].translation()).norm() < 1e-3 * kNoise);
}

TEST_CASE("A pair of robots with one closure is joined after the wait for witnesses",
          "[agent_team]") {
  TeamGraph graph = team_of_three(1);
  bool one = false;
  std::erase_if(graph.edges, [&](const BlockEdge& e) {
    const bool between = is_between(graph, e);
    const bool joins_0_and_1 = between && graph.robot_of(std::max(e.i, e.j)) == 1;
    return between && (!joins_0_and_1 || std::exchange(one, true));
  });
  REQUIRE(one);
  AgentTeamOptions options;
  options.pcm.witness_wait_s = 10.0;
  const AgentTeamRun run = run_agent_team(graph, options);
  CHECK(run.settled);
  CHECK(run.seconds >= 10.0);
  CHECK(run.world_of == std::vector<RobotId>{0, 0, 2});
}

TEST_CASE("Robots' own code refuses planar and interrupted graphs", "[agent_team]") {
  TeamGraph graph = team_of_three(1);
  graph.dimension = 2;
  CHECK_THROWS_AS(run_agent_team(graph, {}), std::invalid_argument);
  graph = team_of_three(1);
  std::erase_if(graph.edges, [](const BlockEdge& e) { return e.i == 4 && e.j == 5; });
  CHECK_THROWS_WITH(run_agent_team(graph, {}), Catch::Contains("0:5"));
}

}  // namespace
}  // namespace km
