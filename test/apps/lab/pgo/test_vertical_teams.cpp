#include <catch2/catch.hpp>

#include "apps/lab/pgo/certificate.hpp"
#include "apps/lab/pgo/local_team.hpp"
#include "apps/lab/pgo/member_team.hpp"
#include "apps/lab/pgo/solvers.hpp"
#include "modules/core/lie.hpp"
#include "modules/pose_graph/chordal.hpp"
#include "modules/pose_graph/tree_newton.hpp"
#include "modules/rbcd/member_rbcd.hpp"
#include "modules/rbcd/rounding.hpp"
#include "test/support/team_graphs.hpp"

// Teams with vertical priors, solved in one process.

namespace km {
namespace {

std::unique_ptr<MemberSolver> trusting_newton(SessionGraph graph, TreePlace place) {
  return std::make_unique<TreeNewton>(std::move(graph), std::move(place),
                                      TreeNewtonOptions{.robust = false});
}

std::unique_ptr<MemberSolver> block_descent(SessionGraph graph, const TreePlace& place) {
  return std::make_unique<MemberRbcd>(std::move(graph), place,
                                      RbcdOptions{.min_relative_decrease = 1e-9});
}

std::vector<SE3> poses_at_start(const TeamGraph& graph) {
  return levelled(chordal_initialisation(graph.poses(), graph.edges), graph.verticals);
}

// Robots drive side by side over level ground, joined by closures all the way. Their odometry
// drifts in pitch, and their verticals have errors of a few milliradians.
TeamGraph level_drive(std::mt19937& rng) {
  constexpr Eigen::Index kLength = 25;
  constexpr Eigen::Index kRobots = 3;
  const SE3 drift = make_pose(so3_exp({0.0, 0.002, 0.0}), Eigen::Vector3d::Zero());
  const auto truth = [](Eigen::Index robot, Eigen::Index k) {
    return make_pose(so3_exp({0.0, 0.0, 0.1 * static_cast<double>(k)}),
                     {1.0 * static_cast<double>(k), 2.0 * static_cast<double>(robot), 0.0});
  };
  TeamGraph graph{.first = {0}};
  const auto noisy = [&](const SE3& T, double sigma) {
    return T * se3_exp(sigma * random_vector<6>(rng));
  };
  for (Eigen::Index robot = 0; robot < kRobots; ++robot) {
    const Eigen::Index begin = graph.first.back();
    for (Eigen::Index k = 0; k < kLength; ++k) {
      graph.ids.push_back({static_cast<RobotId>(robot), static_cast<std::uint32_t>(k)});
      const Eigen::Vector3d up = Eigen::Vector3d::UnitZ() + 0.004 * random_vector<3>(rng);
      graph.verticals.push_back({begin + k, up.normalized(), 1.0 / (0.005 * 0.005)});
      const SE3 T_k = truth(robot, k);
      if (k > 0)
        graph.edges.push_back({begin + k - 1, begin + k,
                               noisy(truth(robot, k - 1).inverse() * T_k, 1e-3) * drift, 2.5e5,
                               1e4});
      if (robot > 0 && k % 4 == 0)
        graph.edges.push_back({begin + k, begin + k - kLength,
                               noisy(T_k.inverse() * truth(robot - 1, k), 1e-2), 1e4, 1e4});
    }
    graph.first.push_back(begin + kLength);
  }
  return graph;
}

}  // namespace

TEST_CASE("Newton's method, block descent and the centralised solver reach one optimum",
          "[newton][vertical]") {
  const unsigned seed = GENERATE(1U, 2U, 3U);
  CAPTURE(seed);
  std::mt19937 rng(seed);
  const TeamGraph graph = level_drive(rng);
  const std::vector<SE3> start = poses_at_start(graph);
  const CentralOptimum central = central_optimum(graph, start);
  const double optimum = central.cost;
  CHECK(central.certified);

  MemberTeam newton(graph, 5, start, trusting_newton);
  const auto rounds = run_team(graph, newton, {.max_rounds = 50}, {});
  CHECK(rounds.size() < 50);
  CHECK(rounds.back().cost == Approx(optimum).epsilon(1e-6));
  CHECK(certify(problem_of(graph, 5), team_poses(graph, newton)).certified);

  MemberTeam descent(graph, 3, start, block_descent);
  CHECK(run_team(graph, descent, {.max_rounds = 400}, {}).back().cost ==
        Approx(optimum).epsilon(1e-6));

  // The estimated ground is level; odometry alone pitches by 50 mrad.
  for (const SE3& T : round_to_poses(team_poses(graph, newton), lifted_identity(5))) {
    CHECK(std::acos(std::min(1.0, T.linear()(2, 2))) < 0.01);
    CHECK(std::abs(T.translation().z() - start[0].translation().z()) < 0.25);
  }
}

TEST_CASE("A team estimates its tilt from any start that is upright on the whole",
          "[newton][vertical]") {
  std::mt19937 rng(4);
  const TeamGraph graph = level_drive(rng);
  const std::vector<SE3> start = poses_at_start(graph);
  std::vector<double> costs;
  for (const double tilt : {0.0, 0.02}) {
    std::vector<SE3> tilted = start;
    for (SE3& T : tilted) T = make_pose(so3_exp({tilt, -tilt, 0.0}), Eigen::Vector3d::Zero()) * T;
    MemberTeam team(graph, 3, tilted, trusting_newton);
    costs.push_back(run_team(graph, team, {.max_rounds = 50}, {}).back().cost);
  }
  CHECK(costs[1] == Approx(costs[0]).epsilon(1e-9));
}

TEST_CASE("Robots with verticals that solve alone are joined upright", "[pgo][vertical]") {
  std::mt19937 rng(4);
  TeamGraph graph = noisy_chain(30, 3, 0.0, rng, 2.0);
  {
    LocalTeam exact(graph);
    CHECK(run_team(graph, exact, {}, {}).back().cost < 1e-9);
  }
  // Closures between robots are tilted; the joined robots are not.
  for (BlockEdge& e : graph.edges)
    if (graph.robot_of(e.i) != graph.robot_of(e.j)) e.T_i_j.linear() *= so3_exp({0.1, 0.2, 0.0});
  LocalTeam team(graph);
  (void)run_team(graph, team, {}, {});
  const LiftedPoses X = team_poses(graph, team);
  for (const VerticalPrior& v : graph.verticals)
    CHECK(vertical_cost(v, X.middleCols<3>(4 * v.pose)) < 1e-9);
}

}  // namespace km
