#include "modules/core/data/covariance.hpp"
#include "modules/core/data/measurement_limits.hpp"
#include "modules/core/geometry/precision.hpp"
#include "modules/recorded_graph/g2o_io.hpp"
#include "modules/recorded_graph/recorded_graph.hpp"
#include "test/support/corrupted_input.hpp"
#include "test/support/shared_data.hpp"
#include "test/support/temporary_folder.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

RelativePose edge(KeyframeId from, KeyframeId to, double x = 1.0) {
  return {from, to, make_pose(Eigen::Matrix3d::Identity(), {x, 0, 0}), Matrix6::Identity()};
}

TEST_CASE("Measurements are sorted into odometry and closures") {
  const std::vector<RelativePose> edges = {
      edge({7, 1}, {7, 2}, 2.0), edge({7, 0}, {7, 1}, 1.0),  // odometry in any order
      edge({7, 2}, {7, 0}),                                  // closure
      edge({7, 0}, {7, 1}, 5.0),                             // second measurement: closure
      edge({7, 1}, {7, 0}),                                  // backwards: closure
      edge({3, 9}, {7, 1}),      edge({7, 2}, {40, 1000}),
  };
  const RecordedGraph graph = make_recorded_graph(edges, "test");

  CHECK(graph.robot == 7);
  CHECK(graph.poses() == 3);
  REQUIRE(graph.odometry.size() == 2);
  CHECK(graph.odometry[0].T_from_to.translation().x() == 1.0);
  CHECK(graph.odometry[1].T_from_to.translation().x() == 2.0);
  CHECK(graph.intra_closures.size() == 3);
  REQUIRE(graph.inter_closures.size() == 2);
  CHECK(graph.inter_closures[1].to == KeyframeId{40, 1000});
}

TEST_CASE("A graph that is not the part of one robot is refused") {
  const RelativePose step = edge({0, 0}, {0, 1});
  const auto refusal = [&](std::vector<RelativePose> edges) {
    edges.push_back(step);
    try {
      (void)make_recorded_graph(edges, "test");
    } catch (const std::runtime_error& error) {
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  CHECK(refusal({edge({0, 2}, {0, 3})}) == "test: no odometry up to 0:3");
  CHECK(refusal({edge({0, 0}, {1, 0}), edge({2, 5}, {0, 3}), edge({0, 1}, {3, 3}),
                 edge({0, 1}, {4, 3})}) == "test: no edge of keyframe 0:2");
  CHECK(refusal({edge({1, 0}, {0, 4000000000})}) == "test: no odometry up to 0:4000000000");
  CHECK(refusal({edge({1, 0}, {1, 1})}) ==
        "test: must hold the odometry of one robot, has that of 0 1");
  CHECK(refusal({edge({1, 0}, {2, 1})}) == "test: edge 1:0 -> 2:1 does not touch robot 0");
  CHECK(refusal({}) == "accepted");
  CHECK_THROWS_WITH(make_recorded_graph({}, "test"), EndsWith("has that of none"));
}

const std::string kHeader =
    "robot_src,pose_src,robot_dst,pose_dst,qx,qy,qz,qw,tx,ty,tz,kappa,tau,is_known_inlier,weight\n";

std::vector<RelativePose> read(const std::string& text) {
  return parse_measurements(text, "test.csv");
}

TEST_CASE("A row of measurements is read with its units") {
  const auto rows = read(kHeader + "3,0,12,5,0,0,0.6,0.8,1,2,3,10000,100,1,1\n");
  REQUIRE(rows.size() == 1);
  CHECK(rows[0].from == KeyframeId{3, 0});
  CHECK(rows[0].to == KeyframeId{12, 5});
  CHECK(rows[0].T_from_to.translation() == Eigen::Vector3d(1, 2, 3));
  CHECK(rows[0].T_from_to.linear()(1, 0) == Approx(0.96));  // sin(2 asin 0.6)
  const Precision precision = precision_of(rows[0].covariance);
  CHECK(precision.kappa == Approx(10000.0));
  CHECK(precision.tau == Approx(100.0));
}

TEST_CASE("A bad row is refused with its line and the reason") {
  const auto [row, reason] = GENERATE(table<std::string, std::string>({
      {"0,0,0,1,0,0,0,1,0,0,0,1", "line ends before tau"},
      {"65536,0,0,1,0,0,0,1,0,0,0,1,1", "robot is not an integer from 0 to 65535: '65536'"},
      {"0,-1,0,1,0,0,0,1,0,0,0,1,1", "pose is not an integer"},
      {"0,0,0,0,0,0,0,1,0,0,0,1,1", "measurement from 0:0 to itself"},
      {"0,0,0,1,0,0,0,2,0,0,0,1,1", "quaternion has length"},
      {"0,0,0,1,0,0,0,1,inf,0,0,1,1", "translation is not finite"},
      {"0,0,0,1,0,0,0,1,0,0,0,0,1", "kappa and tau must be positive"},
      {"0,0,0,1,0,0,0,1,0,1e308,0,1,1", "translation 1e+308 is outside -1e+06 .. 1e+06"},
      {"0,0,0,1,0,0,0,1,0,0,0,1e-300,1", "kappa 1e-300 and tau 1 mean variances outside"},
      {"0,0,0,1,0,0,0,1,0,0,0,1,1e20", "kappa 1 and tau 1e+20 mean variances outside"},
      {"0,0,0,1,0,0,0,1,0,0,0,1,1,1,much", "column after tau is not a number: 'much'"},
  }));
  CAPTURE(row);
  CHECK_THROWS_WITH(read(kHeader + "0,0,0,1,0,0,0,1,0,0,0,1,1\n" + row + '\n'),
                    StartsWith("test.csv:3: ") && Contains(reason));
  CHECK_THROWS_WITH(read("a,b\n"), StartsWith("test.csv:1: the first line must name"));
}

TEST_CASE("The tunnels robots have the poses and edges their source states") {
  if (!shared_data("multi_robot/tunnels_8robots/robot0.csv")) return;
  const std::size_t poses[] = {105, 138, 149, 148, 168, 175, 191, 181};
  std::size_t odometry = 0, intra = 0, inter = 0;
  for (RobotId robot = 0; robot < 8; ++robot) {
    const auto file =
        shared_data("multi_robot/tunnels_8robots/robot" + std::to_string(robot) + ".csv");
    REQUIRE(file);
    const RecordedGraph graph = read_recorded_graph(*file);
    CHECK(graph.robot == robot);
    CHECK(graph.poses() == poses[robot]);
    odometry += graph.odometry.size();
    intra += graph.intra_closures.size();
    inter += graph.inter_closures.size();
  }
  CHECK(odometry == 1247);
  CHECK(intra == 96);
  CHECK(inter == 2 * 3548);  // in the files of both robots
}

TEST_CASE("g2o files of one robot are read in every layout") {
  const auto [name, robot, poses, intra, inter] =
      GENERATE(table<std::string, int, std::size_t, std::size_t, std::size_t>({
          {"door_slam/argos_simulation/clean/example_2robots/1.g2o", 1, 442, 0, 34},
          {"door_slam/argos_simulation/spoiled/example_4robots/2.g2o", 2, 275, 0, 33},
          {"kimera_rpgo/robot_a.g2o", 0, 50, 3, 0},
          {"kimera_rpgo/robot_b.g2o", 1, 42, 2, 0},
      }));
  const auto file = shared_data("multi_robot/" + name);
  if (!file) return;
  CAPTURE(name);
  const RecordedGraph graph = read_recorded_graph(*file);
  CHECK(graph.robot == robot);
  CHECK(graph.poses() == poses);
  CHECK(graph.intra_closures.size() == intra);
  CHECK(graph.inter_closures.size() == inter);
}

TEST_CASE("The part of a robot contains its verticals") {
  const TemporaryFolder folder;
  const auto file = folder.path() / "7.g2o";
  const Vertical second{{0.0, 1.0, 0.0}, 0.01};
  G2oGraph graph;
  graph.edges = {edge({7, 0}, {7, 1}), edge({7, 1}, {7, 2})};
  graph.verticals = {{{7, 2}, {}}, {{7, 1}, second}};
  for (G2oVertical& prior : graph.verticals) prior.vertical.sigma_rad = 0.01;
  write_g2o(file, graph);
  const RecordedGraph read = read_recorded_graph(file);
  REQUIRE(read.verticals.size() == 2);
  CHECK(read.verticals.at(1).up_body.isApprox(second.up_body, 1e-14));
  CHECK(read.verticals.at(1).sigma_rad == Approx(0.01));
  CHECK(read.verticals.at(2).up_body.isApprox(Eigen::Vector3d::UnitZ()));

  const KeyframeId elsewhere = GENERATE(KeyframeId{7, 3}, KeyframeId{8, 0});
  graph.verticals.push_back({elsewhere, second});
  write_g2o(file, graph);
  CHECK_THROWS_WITH(
      read_recorded_graph(file),
      EndsWith("7.g2o: the prior on " + to_string(elsewhere) + " is on no keyframe of robot 7"));
}

TEST_CASE("A planar graph has equal weights in space, and a missing step is unknown") {
  const TemporaryFolder folder;
  const auto file = folder.path() / "0.g2o";
  std::ofstream(file) << "EDGE_SE2 0 1 1 0 0.1 4 0 0 2 0 9\nEDGE_SE2 0 2 1 0 0.1 4 0 0 2 0 9\n";
  const RecordedGraph graph = in_space(read_recorded_graph(file));
  CHECK(graph.dimension == 2);
  REQUIRE(graph.odometry.size() == 2);
  CHECK(precision_of(graph.odometry[0].covariance).kappa == Approx(9.0));
  CHECK(precision_of(graph.odometry[0].covariance).tau == Approx(2.0 / (0.25 + 0.5)));
  CHECK(graph.odometry[1].covariance(5, 5) == Approx(kUnknownStep_m * kUnknownStep_m));
  CHECK(graph.intra_closures.size() == 1);
}

TEST_CASE("A weight that no robot optimises is refused with its edge") {
  const double information = GENERATE(1e14, 2e-12);
  const TemporaryFolder folder;
  G2oGraph graph;
  graph.edges.push_back(edge({7, 0}, {7, 1}));
  graph.edges[0].covariance /= information;
  write_g2o(folder.path() / "7.g2o", graph);
  CHECK_THROWS_WITH(read_recorded_graph(folder.path() / "7.g2o"),
                    Contains("7.g2o: edge 7:0 -> 7:1 has a variance of"));
}

TEST_CASE("Files that are not the part of one robot are refused with their name") {
  // A block of a grid (poses 0, 1, 16, ...), and a file with a broken line.
  const auto [name, reason] = GENERATE(table<std::string, std::string>({
      {"distributed_mapper/blocks_world/2robots/0.g2o", "0.g2o: no "},
      {"door_slam/pairwise_consistency_maximization/spoiled/simulation/example_2robots/1.g2o",
       "1.g2o:16: unknown tag"},
  }));
  const auto file = shared_data("multi_robot/" + name);
  if (!file) return;
  CHECK_THROWS_WITH(read_recorded_graph(*file), Contains(reason));
}

const std::string kUnitLine = " 1 0 0 0 0 0 1 0 0 0 0 1 0 0 0 1 0 0 1 0 1\n";

std::string drive_g2o() {
  std::string text = "# one robot, with a closure and two verticals\n";
  for (int i = 0; i < 6; ++i) {
    const std::string index = std::to_string(i);
    text.append("VERTEX_SE3:QUAT ").append(index).append(" ").append(index);
    text.append(".5 0 0 0 0 0.6 0.8\n");
  }
  for (int i = 0; i < 5; ++i)
    text += "EDGE_SE3:QUAT " + std::to_string(i) + ' ' + std::to_string(i + 1) +
            " 1.25 0.5 -0.125 0 0 0 1" + kUnitLine;
  text += "EDGE_SE3:QUAT 0 5 6.0 2.5 -0.5 0 0 0 1" + kUnitLine;
  text += "PARAMS_SE3OFFSET 0 0 0 0 0 0 0 1\n";
  const std::string tilt = " 0 0 0 0 0 0 1 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 100 0 0 100 0 0\n";
  return text + "EDGE_SE3_PRIOR 0 0" + tilt + "EDGE_SE3_PRIOR 3 0" + tilt;
}

std::string planar_g2o() {
  return "VERTEX_SE2 0 0 0 0\nVERTEX_SE2 1 1 0 0.5\nVERTEX_SE2 2 2 0 1\n"
         "EDGE_SE2 0 1 1 0 0.5 44 0 0 44 0 400\nEDGE_SE2 1 2 1 0 0.5 44 0 0 44 0 400\n"
         "EDGE_SE2 0 2 2 0.5 1 44 0 0 44 0 400\n";
}

std::string drive_csv() {
  std::string text =
      "robot_src,pose_src,robot_dst,pose_dst,qx,qy,qz,qw,tx,ty,tz,kappa,tau,is_known_inlier,"
      "weight\n";
  for (int i = 0; i < 6; ++i)
    text += "3," + std::to_string(i) + ",3," + std::to_string(i + 1) +
            ",0,0,0.6,0.8,1.5,0.25,-3,10000,100,1,1\n";
  return text + "3,2,5,7,0,0,0,1,1,2,3,100,10,0,0.5\n";
}

void check_graph(const G2oGraph& graph) {
  for (const G2oVertex& vertex : graph.vertices) CHECK(vertex.T_world_kf.matrix().allFinite());
  for (const RelativePose& edge : graph.edges) {
    CHECK(edge.T_from_to.matrix().allFinite());
    CHECK(edge.T_from_to.translation().norm() < 1e7);
    CHECK(is_covariance(edge.covariance));
  }
  for (const G2oVertical& prior : graph.verticals) {
    CHECK(prior.vertical.up_body.norm() == Approx(1.0));
    CHECK(prior.vertical.sigma_rad > 0.0);
  }
}

void check_drive(const RecordedGraph& graph) {
  for (const OdometryPose& pose : odometry_poses(graph)) {
    CHECK(pose.T_odom_kf.matrix().allFinite());
    CHECK(pose.covariance.allFinite());
  }
}

TEST_CASE("A corrupted g2o file is refused with its line, or contains a solvable graph") {
  const std::string good = GENERATE(drive_g2o(), planar_g2o());
  check_corrupted<std::runtime_error>(good, "corrupted.g2o", [](const std::string& text) {
    check_graph(parse_g2o(text, "corrupted.g2o"));
  });
}

TEST_CASE("A corrupted graph of a robot is refused with its name, or can be played") {
  const TemporaryFolder folder;
  const auto [name, good] =
      GENERATE(table<std::string, std::string>({{"7.g2o", drive_g2o()}, {"7.csv", drive_csv()}}));
  check_corrupted<std::runtime_error>(good, name, [&, file = name](const std::string& text) {
    check_drive(read_recorded_graph(folder.write(file, text)));
  });
}

TEST_CASE("A path that is not a file of a graph is refused with its name") {
  const std::string extension = GENERATE(".g2o", ".csv");
  check_no_files<std::runtime_error>(extension,
                                     [](const auto& place) { (void)read_recorded_graph(place); });
}

}  // namespace
}  // namespace km
