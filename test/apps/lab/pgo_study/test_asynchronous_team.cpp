#include <algorithm>
#include <catch2/catch.hpp>

#include "apps/lab/pgo_study/asynchronous_team.hpp"
#include "apps/lab/pgo_study/staircase.hpp"
#include "test/apps/lab/pgo_study/certified_optimum.hpp"
#include "test/support/pose_graph_problems.hpp"
#include "test/support/shared_data.hpp"
#include "test/support/team_graphs.hpp"

namespace km {
namespace {

LiftedPoses start_of(const TeamGraph& graph, Eigen::Index rank = 5) {
  return lift(chordal_initialisation(graph.poses(), graph.edges), rank);
}

double cost_of(const TeamGraph& graph, const LiftedPoses& X) {
  return QuadraticProblem(X.rows(), graph.poses(), graph.edges, {}).cost(X);
}

// Sum over edges between robots of the squared changes of their residuals, where `D` changes the
// pose of one end at a time.
double coupling_of(const TeamGraph& graph, const LiftedPoses& D) {
  const Eigen::MatrixXd still = Eigen::MatrixXd::Zero(D.rows(), 4);
  double sum = 0.0;
  for (const BlockEdge& e : graph.edges) {
    if (graph.robot_of(e.i) == graph.robot_of(e.j)) continue;
    sum += edge_cost(D.middleCols<4>(4 * e.i), still, e.T_i_j, e.kappa, e.tau) +
           edge_cost(still, D.middleCols<4>(4 * e.j), e.T_i_j, e.kappa, e.tau);
  }
  return sum;
}

// Two robots with one pose each, of equal rotation, `distance` apart. Their closure measures
// identity, so the cost is tau distance^2, with no gradient on the rotations.
TeamGraph pair_of_robots() {
  return {
      .first = {0, 1, 2}, .edges = {{0, 1, SE3::Identity(), 1.0, 2.0}}, .ids = {{0, 0}, {1, 0}}};
}

LiftedPoses apart(double distance) {
  const SE3 far = make_pose(Eigen::Matrix3d::Identity(), Eigen::Vector3d(distance, 0.0, 0.0));
  return lift(std::vector<SE3>{SE3::Identity(), far}, 3);
}

}  // namespace

TEST_CASE("Robots that move at once approach each other by the step that their weight allows",
          "[pgo_study]") {
  const TeamGraph graph = pair_of_robots();
  const int max_delay = GENERATE(0, 2);
  CAPTURE(max_delay);
  AsynchronousTeam team(graph, apart(1.0), {.max_delay = max_delay, .max_over_relaxation = 1.0});
  RoundMeter meter(2, {});
  while (team.updates() == 0) (void)team.step(meter);
  // A step minimises (p - other)^2 + weight (p - before)^2, with the other robot at its start.
  const double step = 1.0 / (1.0 + 1.01 * (1.0 + 2.0 * max_delay));
  const double moved_0 = team.block(0)(0, 3);
  const double moved_1 = 1.0 - team.block(1)(0, 3);
  if (max_delay == 0) CHECK(team.updates() == 2);
  CHECK(moved_0 + moved_1 ==
        Approx(static_cast<double>(team.updates()) * step).epsilon(kSinglePrecision));
  CHECK(std::max(moved_0, moved_1) == Approx(step).epsilon(kSinglePrecision));
}

TEST_CASE("A block at weight 0 moves all the way to its neighbour, at weight 1 half of it",
          "[pgo_study]") {
  const TeamGraph graph = pair_of_robots();
  const LiftedPoses X = apart(1.0);
  const SessionGraph part = part_of(graph, 0);
  for (const double weight : {0.0, 1.0}) {
    ProximalBlock block(part, X.leftCols<4>(), weight);
    REQUIRE(block.set_neighbour(1, {{0}, X.rightCols<4>()}));
    (void)block.update({}, 1.0);
    CHECK(block.X()(0, 3) == Approx(1.0 / (1.0 + weight)).epsilon(1e-9));
  }
}

TEST_CASE("Asynchronous descent reaches the optimum despite delays and losses", "[pgo_study]") {
  const auto [max_delay, rounds] = GENERATE(table<int, int>({{0, 300}, {1, 400}, {3, 700}}));
  const double loss = GENERATE(0.0, 0.2);
  const double max_over_relaxation = GENERATE(1.0, 1.95);
  const unsigned seed = GENERATE(1U, 2U);
  CAPTURE(max_delay, loss, max_over_relaxation, seed);
  std::mt19937 rng(seed);
  const TeamGraph graph = noisy_chain(24, 3, 0.1, rng);
  AsynchronousTeam team(graph, start_of(graph),
                        {.max_delay = max_delay,
                         .loss = loss,
                         .seed = seed,
                         .max_over_relaxation = max_over_relaxation});
  RoundMeter meter(graph.robots(), {});
  LiftedPoses X = team_poses(graph, team);
  const double start = cost_of(graph, X);
  double bound = start;
  std::vector<double> couplings(static_cast<std::size_t>(max_delay), 0.0);  // newest first
  for (int round = 0; round < rounds; ++round) {
    REQUIRE(team.step(meter));
    const LiftedPoses next = team_poses(graph, team);
    couplings.insert(couplings.begin(), coupling_of(graph, next - X));
    couplings.resize(static_cast<std::size_t>(max_delay));
    X = next;
    // V as in the comment on AsynchronousTeam.
    double V = cost_of(graph, X);
    for (std::size_t age = 0; age < couplings.size(); ++age)
      V += static_cast<double>(couplings.size() - age) * couplings[age];
    REQUIRE(V <= bound + kSinglePrecision * start);
    bound = V;
  }
  CHECK(cost_of(graph, X) == Approx(certified_optimum_of(graph)).epsilon(1e-5));
}

TEST_CASE("A robot waits while poses of its neighbours are too old, and moves again after",
          "[pgo_study]") {
  std::mt19937 rng(3);
  const TeamGraph graph = noisy_chain(30, 3, 0.1, rng);
  const auto updates = [&](int max_delay, double loss) {
    AsynchronousTeam team(graph, start_of(graph), {.max_delay = max_delay, .loss = loss});
    (void)run_team(graph, team, {.max_rounds = 101}, {});
    return team.updates();
  };
  CHECK(updates(0, 0.0) == 300);  // robots only send in the first round
  CHECK(updates(3, 0.0) > 285);   // the first poses arrive up to three rounds later
  const std::size_t lossy = updates(0, 0.5);
  CHECK(lossy > 30);  // poses of both neighbours arrive in a quarter of the rounds
  CHECK(lossy < 120);
}

TEST_CASE("A robot without neighbours moves in every round but the first", "[pgo_study]") {
  std::mt19937 rng(6);
  const TeamGraph graph = noisy_chain(30, 1, 0.1, rng);
  AsynchronousTeam team(graph, start_of(graph),
                        {.max_delay = 5, .loss = 0.9, .max_over_relaxation = 1.0});
  (void)run_team(graph, team, {.max_rounds = 5}, {});
  CHECK(team.updates() == 4);  // robots only send in the first round
  LiftedPoses X = start_of(graph);
  const QuadraticProblem problem = problem_of(graph, X.rows());
  for (int k = 0; k < 4; ++k) X = minimise(problem, std::move(X), {}).X;
  CHECK(problem.cost(team.block(0)) == Approx(problem.cost(X)).epsilon(1e-9));
}

TEST_CASE("Asynchronous results depend on the seed alone", "[pgo_study]") {
  std::mt19937 rng(7);
  const TeamGraph graph = noisy_chain(30, 3, 0.1, rng);
  const auto result = [&](unsigned seed) {
    AsynchronousTeam team(graph, start_of(graph), {.max_delay = 3, .loss = 0.2, .seed = seed});
    (void)run_team(graph, team, {.max_rounds = 30}, {});
    return team_poses(graph, team);
  };
  CHECK(result(1) == result(1));
  CHECK(result(1) != result(2));
}

TEST_CASE("Invalid delays, losses and weights are refused", "[pgo_study]") {
  const TeamGraph graph = pair_of_robots();
  CHECK_THROWS_WITH(AsynchronousTeam(graph, apart(1.0), {.max_delay = -1}),
                    Catch::Contains("max_delay -1"));
  CHECK_THROWS_WITH(AsynchronousTeam(graph, apart(1.0), {.loss = 1.0}), Catch::Contains("loss 1"));
  CHECK_THROWS_WITH(ProximalBlock(part_of(graph, 0), apart(1.0).leftCols<4>(), -1.0),
                    Catch::Contains("weight -1"));
}

TEST_CASE("With old poses the small grid still reaches its optimum", "[pgo_study]") {
  const auto file = shared_data("pose_graphs/3d/smallGrid3D.g2o");
  if (!file) return;
  const TeamGraph graph = partition_contiguously(read_g2o(*file), 5, "smallGrid3D");
  AsynchronousTeam team(graph, start_of(graph), {.max_delay = 2, .loss = 0.05});
  const auto rounds = run_team(graph, team, {.max_rounds = 600}, {});
  CHECK(rounds.back().cost == Approx(1025.398056).epsilon(1e-5));  // SE-Sync, unit quaternions
}

}  // namespace km
