#include <catch2/catch.hpp>

#include "modules/core/covariance.hpp"
#include "modules/recorded_graph/g2o_io.hpp"
#include "modules/recorded_graph/recorded_graph.hpp"
#include "test/support/corrupted_input.hpp"

namespace km {
namespace {

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

}  // namespace

TEST_CASE("A corrupted g2o file is refused with its line, or contains a solvable graph", "[g2o]") {
  const std::string good = GENERATE(drive_g2o(), planar_g2o());
  check_corrupted<std::runtime_error>(good, "corrupted.g2o", [](const std::string& text) {
    check_graph(parse_g2o(text, "corrupted.g2o"));
  });
}

TEST_CASE("A corrupted graph of a robot is refused with its name, or can be played", "[recorded]") {
  const TemporaryFolder folder;
  const auto [name, good] =
      GENERATE(table<std::string, std::string>({{"7.g2o", drive_g2o()}, {"7.csv", drive_csv()}}));
  check_corrupted<std::runtime_error>(good, name, [&, file = name](const std::string& text) {
    check_drive(read_recorded_graph(folder.write(file, text)));
  });
}

TEST_CASE("A path that is not a file of a graph is refused with its name", "[recorded]") {
  const std::string extension = GENERATE(".g2o", ".csv");
  check_no_files<std::runtime_error>(extension,
                                     [](const auto& place) { (void)read_recorded_graph(place); });
}

}  // namespace km
