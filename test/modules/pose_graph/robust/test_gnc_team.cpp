#include <algorithm>
#include <catch2/catch.hpp>

#include "modules/core/lie.hpp"
#include "modules/pose_graph/chordal.hpp"
#include "modules/pose_graph/quadratic_problem.hpp"
#include "modules/pose_graph/robust/central_gnc.hpp"
#include "modules/pose_graph/robust/gnc_team.hpp"
#include "modules/pose_graph/robust/isolated_closures.hpp"
#include "modules/pose_graph/robust/staged_gnc_team.hpp"
#include "test/support/random_pose.hpp"

namespace km {
namespace {

struct SpoiledGrid {
  TeamGraph graph;
  std::size_t true_edges = 0;  // come first
};

// A square walked row by row, with closures between the rows, dealt out in equal runs; sigmas are
// as the weights say. `outliers` are random poses between random keyframes.
SpoiledGrid spoiled_grid(std::mt19937& rng, int side, std::size_t robots, std::size_t outliers) {
  const double sigma = 0.02;
  const double kappa = 0.5 / (sigma * sigma);
  const double tau = 1.0 / (sigma * sigma);
  std::vector<SE3> truth;
  for (int y = 0; y < side; ++y)
    for (int x = 0; x < side; ++x) {
      Vector6 turn = random_vector<6>(rng);
      turn.tail<3>().setZero();
      truth.push_back(SE3(Eigen::Translation3d(x, y, 0.0)) * se3_exp(turn));
    }
  const int n = side * side;
  SpoiledGrid grid;
  for (std::size_t k = 0; k <= robots; ++k)
    grid.graph.first.push_back(static_cast<Eigen::Index>(k) * n /
                               static_cast<Eigen::Index>(robots));
  for (int i = 0; i < n; ++i) grid.graph.ids.push_back({0, static_cast<KeyframeIndex>(i)});
  for (int i = 0; i < n; ++i)
    for (const int step : {1, side})
      if (i + step < n) {
        const Vector6 noise = sigma * random_vector<6>(rng);
        const SE3 T = truth[static_cast<std::size_t>(i)].inverse() *
                      truth[static_cast<std::size_t>(i + step)];
        grid.graph.edges.push_back({i, i + step, T * se3_exp(noise), kappa, tau});
      }
  grid.true_edges = grid.graph.edges.size();
  std::uniform_int_distribution<int> pose(0, n - 1);
  while (grid.graph.edges.size() < grid.true_edges + outliers) {
    const int i = pose(rng);
    const int j = pose(rng);
    if (std::abs(i - j) > 1) grid.graph.edges.push_back({i, j, random_pose(rng, side), kappa, tau});
  }
  return grid;
}

std::vector<bool> expected(const SpoiledGrid& grid) {
  std::vector<bool> kept(grid.graph.edges.size(), false);
  std::fill_n(kept.begin(), grid.true_edges, true);
  return kept;
}

// An outlier threshold that no true closure of these few hundred exceeds: P(chi > 6) < 1e-5.
constexpr double kBarc = 6.0;

GncTeam solved(const TeamGraph& graph, const GncAgentOptions& options) {
  GncTeam team(graph, 3, {}, options);
  RoundMeter meter(graph.robots(), {});
  int rounds = 0;
  while (team.step(meter)) REQUIRE(++rounds < 1000);
  return team;
}

double cost_of(const TeamGraph& graph, const std::vector<SE3>& poses) {
  return QuadraticProblem(3, graph.poses(), graph.edges, {}).cost(lift(poses, 3));
}

// Along the odometry of all robots.
std::vector<SE3> start_poses(const TeamGraph& graph) {
  std::vector<SE3> poses{SE3::Identity()};
  for (const BlockEdge& e : graph.edges)
    if (e.j == e.i + 1) poses.push_back(poses.back() * e.T_i_j);
  return poses;
}

TEST_CASE("GNC rejects exactly the planted outliers", "[gnc]") {
  const unsigned seed = GENERATE(1U, 2U, 3U);
  CAPTURE(seed);
  std::mt19937 rng(seed);
  const SpoiledGrid grid = spoiled_grid(rng, 8, 3, 20);
  GncAgentOptions options;
  options.gnc.barc = kBarc;
  const CentralGnc central = gnc_centrally(grid.graph, options);
  CHECK(central.kept == expected(grid));

  const GncTeam team = solved(grid.graph, options);
  CHECK(team.kept() == expected(grid));
  const SE3 T_central_team = central.T_world_kf[0] * team.agent(0).poses()[0].inverse();
  double farthest = 0.0;
  for (std::size_t k = 0; k < 3; ++k)
    for (std::size_t i = 0; i < team.agent(k).poses().size(); ++i) {
      const SE3& T = central.T_world_kf[static_cast<std::size_t>(grid.graph.first[k]) + i];
      const SE3 moved = T_central_team * team.agent(k).poses()[i];
      farthest = std::max(farthest, (moved.translation() - T.translation()).norm());
    }
  CHECK(farthest < 1e-3);  // a twentieth of sigma: both stop at a relative decrease
}

TEST_CASE("GNC rejects nothing where nothing is wrong", "[gnc]") {
  std::mt19937 rng(5);
  const SpoiledGrid grid = spoiled_grid(rng, 6, 2, 0);
  GncAgentOptions options;
  options.gnc.barc = kBarc;
  CHECK(gnc_centrally(grid.graph, options).kept == expected(grid));
  CHECK(solved(grid.graph, options).kept() == expected(grid));
}

TEST_CASE("both ends of an edge between robots hold the same decision", "[gnc]") {
  std::mt19937 rng(9);
  const SpoiledGrid grid = spoiled_grid(rng, 8, 4, 25);
  GncAgentOptions options;
  options.gnc.barc = kBarc;
  const GncTeam team = solved(grid.graph, options);
  std::map<std::pair<std::size_t, std::size_t>, std::size_t> next;
  int between = 0;
  for (const BlockEdge& e : grid.graph.edges) {
    const std::pair<std::size_t, std::size_t> pair =
        std::minmax({grid.graph.robot_of(e.i), grid.graph.robot_of(e.j)});
    const auto [a, b] = pair;
    if (a == b) continue;
    const std::size_t k = next[pair]++;
    CAPTURE(a, b, k);
    CHECK(team.agent(a).kept(static_cast<RobotId>(b), k) ==
          team.agent(b).kept(static_cast<RobotId>(a), k));
    ++between;
  }
  CHECK(between > 20);
}

TEST_CASE("GNC throws out all closures if all are false, and keeps the odometry", "[gnc]") {
  std::mt19937 rng(11);
  SpoiledGrid grid = spoiled_grid(rng, 6, 3, 8);
  std::erase_if(grid.graph.edges, [](const BlockEdge& e) { return e.j == e.i + 6; });
  GncAgentOptions options;
  options.gnc.barc = kBarc;
  for (const std::vector<bool>& kept :
       {gnc_centrally(grid.graph, options).kept, solved(grid.graph, options).kept()})
    for (std::size_t k = 0; k < kept.size(); ++k)
      CHECK(kept[k] == (grid.graph.edges[k].j == grid.graph.edges[k].i + 1));
}

TEST_CASE("GNC finds a jump in odometry if it may", "[gnc]") {
  std::mt19937 rng(13);
  SpoiledGrid grid = spoiled_grid(rng, 8, 2, 0);
  const auto jump = std::find_if(grid.graph.edges.begin(), grid.graph.edges.end(),
                                 [](const BlockEdge& e) { return e.i == 20 && e.j == 21; });
  REQUIRE(jump != grid.graph.edges.end());
  jump->T_i_j.translation().x() += 4.0;
  std::vector<bool> without_jump = expected(grid);
  without_jump[static_cast<std::size_t>(jump - grid.graph.edges.begin())] = false;
  GncAgentOptions options;
  options.gnc.barc = kBarc;
  options.reject_odometry = true;
  CHECK(gnc_centrally(grid.graph, options).kept == without_jump);
  CHECK(solved(grid.graph, options).kept() == without_jump);
}

TEST_CASE("GNC copes with a start so far off that second derivatives are indefinite", "[gnc]") {
  // A straight walk whose odometry turns all the way round, and closures that say so; all so weak
  // that no residual is beyond the threshold: rotations add at most 8 kappa.
  TeamGraph graph{.first = {0, 20, 40}};
  for (int i = 0; i < 40; ++i) {
    graph.ids.push_back({0, static_cast<KeyframeIndex>(i)});
    const Eigen::AngleAxisd turn(0.16, Eigen::Vector3d::UnitZ());
    if (i + 1 < 40)
      graph.edges.push_back(
          {i, i + 1, make_pose(turn.toRotationMatrix(), Eigen::Vector3d::UnitX()), 1.0, 1e-2});
    for (const int step : {10, 20, 30})
      if (i + step < 40)
        graph.edges.push_back({i, i + step, SE3(Eigen::Translation3d(step, 0.0, 0.0)), 1.0, 1e-2});
  }
  GncAgentOptions options;
  options.gnc.barc = 20.0;
  const GncTeam team = solved(graph, options);
  CHECK(team.agent(0).done());
  const CentralGnc central = gnc_centrally(graph, options, 1e-5, start_poses(graph));
  CHECK(team.agent(0).cost() == Approx(cost_of(graph, central.T_world_kf)).epsilon(1e-9));
}

TEST_CASE("false closures stand alone, true ones beside each other", "[gnc]") {
  const unsigned seed = GENERATE(1U, 2U, 3U);
  CAPTURE(seed);
  std::mt19937 rng(seed);
  const SpoiledGrid grid = spoiled_grid(rng, 10, 4, 60);
  const std::vector<bool> isolated =
      isolated_closures(grid.graph, odometry_edges(grid.graph), kBarc);
  const auto last_true = isolated.begin() + static_cast<std::ptrdiff_t>(grid.true_edges);
  CHECK(std::count(isolated.begin(), last_true, true) == 0);
  // With three others beside each, a few of 60 agree by chance.
  CHECK(std::count(last_true, isolated.end(), true) >= 55);
}

TEST_CASE("GNC in stages rejects as many false closures as there are true ones", "[gnc]") {
  const unsigned seed = GENERATE(1U, 2U);
  CAPTURE(seed);
  std::mt19937 rng(seed);
  SpoiledGrid grid = spoiled_grid(rng, 10, 4, 90);
  // A true one far from all others comes back in.
  std::vector<bool> kept = expected(grid);
  const auto lone = std::find_if(grid.graph.edges.begin(), grid.graph.edges.end(),
                                 [](const BlockEdge& e) { return e.i == 45 && e.j == 55; });
  REQUIRE(lone != grid.graph.edges.end());
  for (const BlockEdge& e : std::vector<BlockEdge>(grid.graph.edges))
    if (e.j == e.i + 10 && e.i != 45 && std::abs(e.i - 45) <= 5) {
      const auto beside =
          std::find_if(grid.graph.edges.begin(), grid.graph.edges.end(),
                       [&](const BlockEdge& other) { return other.i == e.i && other.j == e.j; });
      kept.erase(kept.begin() + (beside - grid.graph.edges.begin()));
      grid.graph.edges.erase(beside);
    }
  GncAgentOptions options;
  options.gnc.barc = kBarc;
  StagedGncTeam team(grid.graph, 3, options);
  CHECK(team.isolated() >= 80);
  RoundMeter meter(grid.graph.robots(), {});
  int rounds = 0;
  while (team.step(meter)) REQUIRE(++rounds < 300);
  CHECK(team.done());
  CHECK(team.kept() == kept);
}

TEST_CASE("few isolated closures stand aside where they make much more work", "[gnc]") {
  std::mt19937 rng(43);
  GncAgentOptions options;
  options.gnc.barc = kBarc;
  // Of 870 + 150 closures 15 % are false: by their number alone they would be heard.
  const SpoiledGrid large = spoiled_grid(rng, 30, 4, 150);
  CHECK(StagedGncTeam(large.graph, 3, options).isolated() >= 130);
  // More than an eighth of 182 + 40, on a map that is eliminated in no time.
  const SpoiledGrid small = spoiled_grid(rng, 14, 4, 40);
  CHECK(StagedGncTeam(small.graph, 3, options).isolated() == 0);
}

TEST_CASE("two edges between the same keyframes are a step of odometry and a closure", "[gnc]") {
  TeamGraph graph{.first = {0, 3}, .ids = {{4, 0}, {4, 1}, {5, 2}}};
  for (const auto& [i, j] : {std::pair{0, 1}, {0, 1}, {1, 2}, {1, 0}})
    graph.edges.push_back({i, j, SE3::Identity(), 1.0, 1.0});
  CHECK(odometry_edges(graph) == std::vector<bool>{true, false, false, false});
}

}  // namespace
}  // namespace km
