#include "apps/lab/pgo/team_graph_file.hpp"

#include "test/support/shared_data.hpp"
#include "test/support/temporary_folder.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

G2oGraph graph_of(const std::string& text) {
  return parse_g2o(text, "graph.g2o");
}

std::string planar_edge(int i, int j, const std::string& information = "4 0 0 4 0 9") {
  return "EDGE_SE2 " + std::to_string(i) + ' ' + std::to_string(j) + " 1 0 0.1 " + information +
         '\n';
}

}  // namespace

TEST_CASE("Weights of a planar graph are those of the plane") {
  const G2oGraph graph = graph_of(planar_edge(0, 1, "4 0 0 2 0 9"));
  const Precision weight = precision_of_blocks(graph.edges[0].covariance, 2);
  CHECK(weight.kappa == Approx(9.0));
  CHECK(weight.tau == Approx(2.0 / (0.25 + 0.5)));
}

TEST_CASE("Cross terms are dropped before the information is inverted") {
  const Precision with =
      precision_of_blocks(graph_of(planar_edge(0, 1, "4 0 3 4 1 9")).edges[0].covariance, 2);
  CHECK(with.kappa == Approx(9.0));
  CHECK(with.tau == Approx(4.0));
  Matrix6 covariance = Matrix6::Zero();
  covariance.diagonal() << 0.1, 0.1, 0.1, 0.2, 0.2, 0.2;
  const Precision spatial = precision_of_blocks(covariance, 3);
  CHECK(spatial.kappa == Approx(3.0 / (2.0 * 0.3)));
  CHECK(spatial.tau == Approx(3.0 / 0.6));
}

TEST_CASE("Covariances that are not positive definite are refused") {
  Matrix6 covariance = Matrix6::Identity();
  covariance(0, 0) = GENERATE(0.0, -1.0, std::numeric_limits<double>::quiet_NaN(),
                              std::numeric_limits<double>::infinity());
  CHECK_THROWS_AS(precision_of_blocks(covariance, 3), std::invalid_argument);
}

TEST_CASE("Poses are divided in the order of their ids, and the last robot gets the rest") {
  // Vertices and edges out of order; ids with gaps.
  std::string text = "VERTEX_SE2 7 0 0 0\nVERTEX_SE2 2 0 0 0\nVERTEX_SE2 3 0 0 0\n";
  text += "VERTEX_SE2 20 0 0 0\nVERTEX_SE2 9 0 0 0\n";
  text += planar_edge(20, 9) + planar_edge(2, 3) + planar_edge(9, 7) + planar_edge(3, 7);
  const TeamGraph graph = partition_contiguously(graph_of(text), 2, "graph.g2o");
  CHECK(graph.first == std::vector<Eigen::Index>{0, 2, 5});
  std::vector<std::uint32_t> indices;
  for (const KeyframeId& id : graph.ids) indices.push_back(id.index);
  CHECK(indices == std::vector<std::uint32_t>{2, 3, 7, 9, 20});
  CHECK(graph.edges[0].i == 4);
  CHECK(graph.edges[0].j == 3);
  CHECK(graph.robot_of(1) == 0);
  CHECK(graph.robot_of(2) == 1);
  const PoseEdge between = part_of(graph, 0).between.at(0);
  CHECK(between.end_on(0).index == 1);
  CHECK(between.end_on(1).index == 0);
}

TEST_CASE("Every edge belongs to one robot or to two, and parallel edges all count") {
  const std::string text = planar_edge(0, 1) + planar_edge(0, 1) + planar_edge(1, 2) +
                           planar_edge(2, 1) + planar_edge(2, 3);
  const TeamGraph graph = partition_contiguously(graph_of(text), 2, "graph.g2o");
  CHECK(graph.edges.size() == 5);
  const SessionGraph a = part_of(graph, 0);
  const SessionGraph b = part_of(graph, 1);
  CHECK(a.own.size() == 2);
  CHECK(b.own.size() == 1);
  REQUIRE(a.between.size() == 2);
  REQUIRE(b.between.size() == 2);
  for (const SessionGraph* part : {&a, &b}) {
    CHECK(part->between[0].from == KeyframeId{0, 1});
    CHECK(part->between[0].to == KeyframeId{1, 0});
    CHECK(part->between[1].from == KeyframeId{1, 0});
  }
}

TEST_CASE("A robot's own odometry comes before its closures") {
  const std::string text = planar_edge(0, 2) + planar_edge(1, 2) + planar_edge(0, 1) +
                           planar_edge(2, 1) + planar_edge(2, 3);
  const SessionGraph part = part_of(partition_contiguously(graph_of(text), 1, "graph.g2o"), 0);
  REQUIRE(part.own.size() == 5);
  CHECK(part.odometry == 3);
  for (std::size_t k = 0; k < part.own.size(); ++k)
    CHECK((part.own[k].to.index == part.own[k].from.index + 1) == (k < part.odometry));
  CHECK(part.between.empty());
}

TEST_CASE("Without cut steps, only closures connect the robots of a graph") {
  std::string text;
  for (int i = 0; i < 5; ++i) text += planar_edge(i, i + 1);
  const TeamGraph whole =
      partition_contiguously(graph_of(text + planar_edge(1, 4)), 2, "graph.g2o");
  TeamGraph graph = without_cut_steps(whole);
  CHECK(graph.edges.size() == 5);
  CHECK(part_of_poses(graph) == std::vector<Eigen::Index>(6, 0));
  graph.edges.pop_back();
  CHECK(part_of_poses(graph) == std::vector<Eigen::Index>{0, 0, 0, 3, 3, 3});
}

TEST_CASE("Graphs that cannot be divided are refused with the reason") {
  const auto deal_out = [](const std::string& text, std::size_t robots) {
    return partition_contiguously(graph_of(text), robots, "graph.g2o");
  };
  CHECK_THROWS_WITH(deal_out(planar_edge(0, 1), 3), Contains("2 poses") && Contains("3 robots"));
  CHECK_THROWS_WITH(deal_out(planar_edge(0, 1), 0), Contains("0 robots"));
  CHECK_THROWS_WITH(deal_out(planar_edge(0, 1) + planar_edge(2, 3), 1),
                    Contains("not connected") && Contains("0:0") && Contains("0:2"));
  CHECK_THROWS_WITH(deal_out("VERTEX_SE2 0 0 0 0\n" + planar_edge(0, 1), 1),
                    Contains("edge 0:0 -> 0:1 names vertex 0:1"));
  CHECK_THROWS_WITH(
      deal_out("VERTEX_SE2 5 0 0 0\nVERTEX_SE2 0 0 0 0\nVERTEX_SE2 1 0 0 0\n" + planar_edge(0, 1),
               1),
      Contains("not connected"));
  CHECK_THROWS_WITH(deal_out(planar_edge(0, 1, "0 0 0 0 0 0"), 1),
                    Contains("graph.g2o:1: information matrix is not positive definite"));
  CHECK_THROWS_WITH(deal_out(planar_edge(0, 1, "nan 0 0 1 0 1"), 1), Contains("graph.g2o:1:"));
}

TEST_CASE("The tunnels' edges between robots count once") {
  const auto folder = shared_data("multi_robot/tunnels_8robots");
  if (!folder) return;
  const TeamGraph graph = read_team_folder(*folder);
  CHECK(graph.robots() == 8);
  CHECK(graph.poses() == 1255);
  CHECK(graph.edges.size() == 1247 + 96 + 3548);
}

TEST_CASE("Each vertical goes to the robot of its pose") {
  const std::string level = " 0 0 0 0 0 0 1 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 9 0 0 9 0 0\n";
  const std::string unit = " 1 0 0 0 0 0 1 1 0 0 0 0 0 1 0 0 0 0 1 0 0 0 1 0 0 1 0 1\n";
  std::string text = "PARAMS_SE3OFFSET 0 0 0 0 0 0 0 1\n";
  for (const char* prior : {"4", "1", "3"})
    text += "EDGE_SE3_PRIOR " + std::string(prior) + " 0" + level;
  for (const char* edge : {"0 1", "1 2", "2 3", "3 4"})
    text += "EDGE_SE3:QUAT " + std::string(edge) + unit;
  const TeamGraph graph = partition_contiguously(graph_of(text), 2, "graph.g2o");
  REQUIRE(graph.verticals.size() == 3);
  CHECK(graph.verticals[0].pose == 1);
  CHECK(graph.verticals[1].pose == 3);
  CHECK(graph.verticals[2].pose == 4);
  CHECK(graph.verticals[0].weight == Approx(9.0));
  REQUIRE(part_of(graph, 0).verticals.size() == 1);
  CHECK(part_of(graph, 0).verticals[0].pose == 1);
  REQUIRE(part_of(graph, 1).verticals.size() == 2);
  CHECK(part_of(graph, 1).verticals[0].pose == 1);
  CHECK(part_of(graph, 1).verticals[1].pose == 2);
  CHECK(problem_of(graph, 3).verticals().size() == 3);
  CHECK_THROWS_WITH(
      partition_contiguously(graph_of(text + "EDGE_SE3_PRIOR 7 0" + level), 2, "g.g2o"),
      "g.g2o: the prior on 0:7 is on a vertex that the file lacks");
}

TEST_CASE("A folder's verticals are those of all its files") {
  const TemporaryFolder folder;
  for (const RobotId robot : {RobotId{4}, RobotId{2}}) {
    const auto edge = [&](KeyframeId from, KeyframeId to) {
      return RelativePose{from, to, SE3::Identity(), Matrix6::Identity()};
    };
    G2oGraph graph;
    graph.edges = {edge({robot, 0}, {robot, 1}), edge({2, 0}, {4, 0})};
    graph.verticals = {{{robot, 1}, {Eigen::Vector3d::UnitX(), 0.1 * robot}}};
    write_g2o(folder.path() / (std::to_string(robot) + ".g2o"), graph);
  }
  const bool left_by_a_run = GENERATE(false, true);
  CAPTURE(left_by_a_run);
  if (left_by_a_run) {
    for (const std::string robot : {"4", "2"}) {
      fs::create_directory(folder.path() / robot);
      fs::rename(folder.path() / (robot + ".g2o"), folder.path() / robot / "pose_graph.g2o");
    }
    folder.write("label_palette.csv", "id,name\n");
  }
  const TeamGraph graph = read_team_folder(folder.path());
  REQUIRE(graph.verticals.size() == 2);
  CHECK(graph.verticals[0].pose == 1);
  CHECK(graph.verticals[0].weight == Approx(25.0));
  CHECK(graph.verticals[1].pose == 3);
  CHECK(graph.verticals[1].weight == Approx(6.25));
  CHECK(graph.verticals[1].up.isApprox(Eigen::Vector3d::UnitX(), 1e-12));
}

TEST_CASE("A folder and a run have the weights that robots use") {
  Matrix6 covariance = Matrix6::Identity();
  covariance(1, 5) = covariance(5, 1) = 0.8;
  G2oGraph graph;
  graph.edges = {{{3, 0}, {3, 1}, SE3::Identity(), covariance}};
  const TemporaryFolder folder;
  write_g2o(folder.path() / "a.g2o", graph);
  const auto check_weights = [&] {
    const BlockEdge edge = read_team_folder(folder.path()).edges.at(0);
    CHECK(edge.kappa == Approx(precision_of(covariance).kappa));
    CHECK(edge.tau == Approx(precision_of(covariance).tau));
  };
  check_weights();
  fs::create_directory(folder.path() / "robot3");
  fs::rename(folder.path() / "a.g2o", folder.path() / "robot3" / "pose_graph.g2o");
  check_weights();

  graph.edges.push_back({{3, 0}, {7, 2}, SE3::Identity(), covariance});
  write_g2o(folder.path() / "robot3" / "pose_graph.g2o", graph);
  CHECK_THROWS_WITH(read_team_folder(folder.path()),
                    Contains("the graph of robot 3 has edges to robot 7, whose file is not there"));
}

TEST_CASE("A folder that holds no team is refused") {
  const TemporaryFolder folder;
  CHECK_THROWS_WITH(read_team_folder(folder.path()), Contains("no *.csv and no *.g2o"));
  CHECK_THROWS_WITH(read_team_folder(folder.path() / "x"), Contains("is not a folder"));
}

}  // namespace km
