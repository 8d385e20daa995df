#include <catch2/catch.hpp>

#include "test/support/pgo_team.hpp"
#include "test/support/shared_data.hpp"
#include "test/support/split_graph.hpp"

namespace km {
namespace {

constexpr double kHour_s = 3600.0;

void add_all(PgoTeam& team, const SplitGraph& graph, const PoseGraphConfig& config) {
  for (const auto& [robot, count] : graph.keyframes)
    feed(team.add({robot, robot + 1000U}, config), robot, graph);
}

PoseGraphConfig config_of(PgoMethod method) {
  PoseGraphConfig config;
  config.method = method;
  return config;
}

RelativePose exact_edge(const KeyframeId& from, const KeyframeId& to, const SE3& T_from_to) {
  return {from, to, T_from_to, covariance_of({.kappa = 10.0, .tau = 5.0})};
}

}  // namespace

TEST_CASE("one robot alone solves an exact triangle", "[pose_graph][agent]") {
  const PgoMethod method = GENERATE(PgoMethod::kRbcd, PgoMethod::kNewton);
  CAPTURE(to_string(method));
  std::mt19937 rng(1);
  std::vector<SE3> truth{SE3::Identity(), random_pose(rng), random_pose(rng)};
  SplitGraph graph{.keyframes = {{4, 3}}, .odometry = {}, .closures = {}};
  graph.odometry = {exact_edge({4, 0}, {4, 1}, truth[1]),
                    exact_edge({4, 1}, {4, 2}, truth[1].inverse() * truth[2])};
  graph.closures = {exact_edge({4, 0}, {4, 2}, truth[2])};
  PgoTeam team;
  add_all(team, graph, config_of(method));
  REQUIRE(team.run(1.0, [&] { return team.all_settled(); }));
  REQUIRE(team.trajectory(4) != nullptr);
  CHECK(team.trajectory(4)->anchor == 4);
  for (std::size_t i = 0; i < 3; ++i)
    CHECK(team.trajectory(4)->T_world_kf[i].isApprox(truth[i], 1e-4));
}

TEST_CASE("three robots with frames of their own end in the anchor's", "[pose_graph][agent]") {
  const PgoMethod method = GENERATE(PgoMethod::kRbcd, PgoMethod::kNewton);
  CAPTURE(to_string(method));
  // Check P7: b's frame starts at (1, 0, 0), c's is turned by 180 degrees.
  const SE3 step = make_pose(Eigen::Matrix3d::Identity(), {1.0, 0.0, 0.0});
  const RobotId a = 7, b = 300, c = 41;
  SplitGraph graph{.keyframes = {{a, 2}, {b, 2}, {c, 2}}, .odometry = {}, .closures = {}};
  const SE3 still = SE3::Identity();
  graph.odometry = {exact_edge({a, 0}, {a, 1}, still), exact_edge({b, 0}, {b, 1}, step),
                    exact_edge({c, 0}, {c, 1}, step)};
  graph.closures = {exact_edge({a, 0}, {b, 0}, still), exact_edge({a, 1}, {b, 1}, step),
                    exact_edge({a, 0}, {c, 0}, still), exact_edge({a, 1}, {c, 1}, step)};
  // Where each first keyframe is in its odometry's frame: only the anchor's matters.
  std::mt19937 rng(3);
  for (const RobotId robot : {a, b, c}) graph.T_odom_first[robot] = random_pose(rng);
  const SE3 T_world_first = graph.T_odom_first.at(a);
  PgoTeam team;
  add_all(team, graph, config_of(method));
  REQUIRE(team.run(10.0, [&] { return team.all_settled(); }));
  for (const RobotId robot : {a, b, c}) {
    CAPTURE(robot);
    REQUIRE(team.trajectory(robot) != nullptr);
    CHECK(team.trajectory(robot)->anchor == a);
    const auto& poses = team.trajectory(robot)->T_world_kf;
    CHECK(poses[0].isApprox(T_world_first, 1e-6));
    CHECK(poses[1].isApprox(robot == a ? T_world_first : T_world_first * step, 1e-6));
  }
}

struct Known {
  const char* file;
  double optimum;  // SE-Sync, certified, same cost
};

TEST_CASE("block descent reaches the optima of split graphs and no update raises the cost",
          "[pose_graph][agent]") {
  const Known known = GENERATE(Known{"smallGrid3D", 1025.39802}, Known{"sphere2500", 1687.00567},
                               Known{"torus3D", 24227.0415});
  CAPTURE(known.file);
  const auto path = shared_data(std::string("pose_graphs/3d/") + known.file + ".g2o");
  if (!path) return;
  const SplitGraph graph = split(read_g2o(*path), {12, 3, 40000, 77, 5});
  PoseGraphConfig config = config_of(PgoMethod::kRbcd);
  config.max_rounds = 500;
  PgoTeam team;
  double cost = std::numeric_limits<double>::infinity();
  team.on_update = [&](RobotId robot) {
    if (team.progress(robot).round < 10) return;  // while blocks are being aligned
    const double now = team_cost(team, graph);
    CHECK(now <= cost * (1.0 + 1e-9));  // rounding of public poses to single precision
    cost = now;
  };
  add_all(team, graph, config);
  REQUIRE(team.run(kHour_s, [&] { return team.all_settled(); }));
  const OptimizerProgress& progress = team.progress(3);
  CAPTURE(progress.round, progress.cost);
  CHECK(progress.anchor == 3);
  CHECK(progress.members == std::vector<RobotId>{3, 5, 12, 77, 40000});
  CHECK(progress.round <= 500);
  CHECK(progress.cost == Approx(team_cost(team, graph)).epsilon(1e-4));
  CHECK(std::abs(rounded_cost(team, graph) - known.optimum) < 1e-4 * known.optimum);
}

TEST_CASE("Newton's method reaches the optima of split graphs to the last digits",
          "[pose_graph][agent]") {
  const Known known = GENERATE(Known{"smallGrid3D", 1025.39802}, Known{"sphere2500", 1687.00567});
  CAPTURE(known.file);
  const auto path = shared_data(std::string("pose_graphs/3d/") + known.file + ".g2o");
  if (!path) return;
  const SplitGraph graph = split(read_g2o(*path), {12, 3, 40000, 77, 5});
  PgoTeam team({.max_delay_s = 0.02, .seed = 3});
  add_all(team, graph, config_of(PgoMethod::kNewton));
  REQUIRE(team.run(kHour_s, [&] { return team.all_settled(); }));
  const OptimizerProgress& progress = team.progress(3);
  CAPTURE(progress.round, progress.cost);
  CHECK(progress.members == std::vector<RobotId>{3, 5, 12, 77, 40000});
  // What the solvers know as the team's cost is that of the trajectories that all have published,
  // each rounded with the anchor that it was told in single precision.
  CHECK(std::abs(rounded_cost(team, graph) - progress.cost) < 1e-10 * progress.cost);
  // SE-Sync takes the rounded quaternions of the files as they are: up to 2e-7 of the cost.
  CHECK(std::abs(progress.cost - known.optimum) < 3e-7 * known.optimum);
  for (const auto& [robot, count] : graph.keyframes)
    CHECK(team.progress(robot).cost == progress.cost);
  CHECK(team.notices.empty());
}

TEST_CASE("the optimum does not depend on split, delays, order or copies", "[pose_graph][agent]") {
  const PgoMethod method = GENERATE(PgoMethod::kRbcd, PgoMethod::kNewton);
  CAPTURE(to_string(method));
  const auto path = shared_data("pose_graphs/3d/smallGrid3D.g2o");
  if (!path) return;
  const std::vector<RobotId> ids =
      GENERATE(values<std::vector<RobotId>>({{9, 2}, {1, 60000, 8}, {5, 4, 3, 2, 1}}));
  const NetworkConditions network =
      GENERATE(values<NetworkConditions>({{},
                                          {.max_delay_s = 0.05, .duplicated = 0.3, .seed = 4},
                                          {.max_delay_s = 0.02, .lost = 0.05, .seed = 5}}));
  CAPTURE(ids, network.max_delay_s, network.duplicated, network.lost);
  const SplitGraph graph = split(read_g2o(*path), ids);
  PgoTeam team(network);
  add_all(team, graph, config_of(method));
  REQUIRE(team.run(kHour_s, [&] { return team.all_settled(); }));
  CHECK(std::abs(rounded_cost(team, graph) - 1025.39802) < 1e-4 * 1025.39802);
}

}  // namespace km
