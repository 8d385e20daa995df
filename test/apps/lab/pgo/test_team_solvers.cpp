#include "apps/lab/pgo/member_team.hpp"
#include "apps/lab/pgo/solvers.hpp"
#include "modules/core/geometry/lie.hpp"
#include "modules/rbcd/member_rbcd.hpp"
#include "modules/tree_newton/chordal.hpp"
#include "test/support/pose_graph_problems.hpp"
#include "test/support/team_graphs.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

// Clock that advances by one unit at every use.
TeamMeter counting_meter(double& clock) {
  return {.cpu_s = [&clock] { return clock += 1.0; }};
}

// Only the first entry of the record of `local` depends on it.
std::vector<SE3> any_start(const TeamGraph& graph) {
  return std::vector<SE3>(static_cast<std::size_t>(graph.poses()), SE3::Identity());
}

MemberTeam rbcd_team(const TeamGraph& graph, std::vector<SE3> start, const RbcdOptions& options) {
  return {graph, std::move(start), [options](SessionGraph part, const TreePlace& place) {
            return std::make_unique<MemberRbcd>(std::move(part), place, options);
          }};
}

}  // namespace

TEST_CASE("The work of a round has the times of its slowest robot and of all robots") {
  double clock = 0.0;
  RoundMeter meter(3, counting_meter(clock));
  meter.run(0, [] {});
  meter.run(0, [] {});
  CHECK(meter.run(2, [] { return 7; }) == 7);
  meter.sent(3);
  meter.sent(4);
  const TeamWork work = meter.finish_round();
  CHECK(work.critical_path_s == 2.0);
  CHECK(work.total_cpu_s == 3.0);
  CHECK(work.bytes == 7);
  CHECK(meter.finish_round().total_cpu_s == 0.0);
}

TEST_CASE("The critical path of a round is the sum over its exchanges") {
  double clock = 0.0;
  RoundMeter meter(2, counting_meter(clock));
  meter.run(0, [] {});
  meter.run(0, [] {});
  meter.run(1, [] {});
  meter.finish_exchange();
  meter.run(1, [] {});
  const TeamWork work = meter.finish_round();
  CHECK(work.critical_path_s == 3.0);
  CHECK(work.total_cpu_s == 4.0);
}

TEST_CASE("A round of block descent counts the bytes of its messages") {
  const WoundRing ring(24, 3);  // each robot's first and last pose are public
  const Eigen::Index rank = GENERATE(3, 5);
  MemberTeam team = rbcd_team(ring.graph, ring.wound, {.rank = rank, .max_rounds = 1});
  const auto rounds = run_team(ring.graph, team, 1000, {});
  REQUIRE(rounds.size() == 2);
  CHECK(rounds[1].round == 1);
  constexpr std::size_t kHeader = 2;                        // kind and round
  const auto numbers = static_cast<std::size_t>(4 * rank);  // numbers per pose
  const std::size_t starts = 6 * (7 * sizeof(float) + 2);
  const std::size_t poses = 6 * (kHeader + numbers * sizeof(float));
  const std::size_t shares = 2 * 2 * (kHeader + 2 * sizeof(double) + 1);  // before and after the
                                                                          // round
  const std::size_t progress = 2 * (kHeader + 2 + (2 + numbers) * sizeof(double));
  CHECK(rounds[1].work.bytes == starts + poses + shares + progress);
}

TEST_CASE("Without noise, robots that solve alone and are joined have no cost") {
  std::mt19937 rng(4);
  const TeamGraph graph = noisy_chain(30, 3, 0.0, rng);
  const SolverRun run = run_solver(graph, any_start(graph), {.method = "local"}, {});
  CHECK(run.rounds.back().round == 1);
  CHECK(run.rounds.back().cost < 1e-9);
}

TEST_CASE("A robot whose own edges do not connect its poses cannot solve alone") {
  std::mt19937 rng(4);
  TeamGraph graph = noisy_chain(30, 3, 0.0, rng);
  std::erase_if(graph.edges, [&](const BlockEdge& e) {
    return (e.i == 15 || e.j == 15) && graph.robot_of(e.i) == graph.robot_of(e.j);
  });
  CHECK_THROWS_WITH(run_solver(graph, any_start(graph), {.method = "local"}, {}),
                    Contains("robot 1 cannot solve alone"));
}

TEST_CASE("Robots with verticals that solve alone are joined upright") {
  std::mt19937 rng(4);
  TeamGraph graph = noisy_chain(30, 3, 0.0, rng, 2.0);
  // Closures between robots are tilted; the joined robots are not.
  for (BlockEdge& e : graph.edges)
    if (graph.robot_of(e.i) != graph.robot_of(e.j)) e.T_i_j.linear() *= so3_exp({0.1, 0.2, 0.0});
  const std::vector<SE3> poses = run_solver(graph, any_start(graph), {.method = "local"}, {}).poses;
  for (const VerticalPrior& v : graph.verticals)
    CHECK(vertical_cost(v, poses[static_cast<std::size_t>(v.pose)].linear()) < 1e-9);
}

}  // namespace km
