#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <map>
#include <utility>

#include "test/support/shared_data.hpp"
#include "test/system/team_run.hpp"

namespace km {
namespace {

constexpr int kRobots = 8;

/// Closures that the robots have kept.
struct KeptClosures {
  std::size_t count = 0;
  std::map<std::pair<int, int>, std::size_t> between = {};  ///< Two robots, the lower one first.
  double largest = 0.0;  ///< Residual in the team's frame [sigma].
};

KeptClosures kept_closures(const TeamResult& team) {
  KeptClosures kept;
  for (const BlockEdge& e : team.graph.edges) {
    const auto i = static_cast<std::size_t>(e.i), j = static_cast<std::size_t>(e.j);
    if (team.robot_of[i] == team.robot_of[j] && e.j == e.i + 1) continue;  // odometry
    ++kept.count;
    if (team.robot_of[i] != team.robot_of[j])
      ++kept.between[std::minmax(team.robot_of[i], team.robot_of[j])];
    const Eigen::MatrixXd T_i = team.poses[i].matrix().topRows<3>();
    const Eigen::MatrixXd T_j = team.poses[j].matrix().topRows<3>();
    kept.largest = std::max(kept.largest, std::sqrt(edge_cost(T_i, T_j, e.T_i_j, e.kappa, e.tau)));
  }
  return kept;
}

TEST_CASE("Eight processes bring the tunnels graph into one frame", "[system][slow]") {
  const auto dataset = shared_data("multi_robot/tunnels_8robots");
  if (!dataset) return;
  const TemporaryFolder folder;
  // By default the last session waits until the bytes of the first ones are paid.
  const TeamRun run = run_team("config/teams/tunnels.yaml", *dataset, folder, {},
                               "--set pose_graph.exchange_budget_kb_s=200");
  CAPTURE(run.result.output);
  REQUIRE(run.result.exit_code == 0);

  for (const auto& robot : run.json["robots"]) {
    CHECK(robot["pgo"]["members"].size() == kRobots);
    CHECK(robot["pgo"]["anchor"] == 0);
  }
  const TeamResult team = read_team(folder.path(), kRobots);
  CHECK(team.poses.size() == 1255);
  const KeptClosures kept = kept_closures(team);
  // In eleven runs, five of them on a busy machine, 2650 to 3005 are kept, with a standard
  // deviation of 105. The number depends on the noise that the robots estimate, and so on when they
  // meet. The upper bound is four standard deviations above the mean. Robust solvers agree on 2669
  // to 2987.
  CHECK(kept.count >= 2500);
  CHECK(kept.count <= 3310);
  // One frame: closures between every two robots fit in it. The threshold is 6.2 sigma of the noise
  // that the robots estimate, 3.3 to 6.7 times the stated noise, depending on when they meet. If
  // the worst false closure is kept, its residual is 440 sigma.
  CHECK(kept.between.size() == kRobots * (kRobots - 1) / 2);
  CHECK(kept.largest <= 15.0 * 6.2);
  for (const auto& [pair, count] : kept.between) CHECK(count >= 20);  // measured: 46 or more

  const double reached = cost_of(team.graph, team.poses);
  const double gap = reached / solve_centrally(team.graph).cost - 1.0;
  std::cout << "tunnels: closures kept " << kept.count << ", largest residual " << kept.largest
            << " sigma, cost " << reached << ", gap " << gap << '\n';
  CHECK(gap < 1e-9);  // solved to convergence; measured: at most 1.4e-11
}

}  // namespace
}  // namespace km
