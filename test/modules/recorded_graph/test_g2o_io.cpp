#include "modules/core/data/covariance.hpp"
#include "modules/core/geometry/precision.hpp"
#include "modules/recorded_graph/g2o_io.hpp"
#include "test/support/random_pose.hpp"
#include "test/support/shared_data.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

G2oGraph read_graph(const std::string& text) {
  return parse_g2o(text, "test.g2o");
}

const std::string kVertex = "VERTEX_SE3:QUAT 0 1 2 3 0 0 0 1\n";
const std::string kPose = " 1 2 3 0 0 0.6 0.8";
const std::string kUnit = " 1 0 0 0 0 0 1 0 0 0 0 1 0 0 0 1 0 0 1 0 1";

TEST_CASE("g2o's translation-first information becomes a rotation-first covariance") {
  // Diagonal 1..6 and one cross term between x (row 0) and roll (row 3).
  const auto graph =
      read_graph("EDGE_SE3:QUAT 0 1" + kPose + " 1 0 0 0.5 0 0 2 0 0 0 0 3 0 0 0 4 0 0 5 0 6\n");
  REQUIRE(graph.edges.size() == 1);
  Matrix6 expected = Matrix6::Identity();  // information, [rotation; translation]
  expected.diagonal() << 4, 5, 6, 1, 2, 3;
  expected(0, 3) = expected(3, 0) = 0.5;
  CHECK((graph.edges[0].covariance * expected).isApprox(Matrix6::Identity(), 1e-12));
}

TEST_CASE("g2o poses are read in the order t, x y z w and normalised") {
  const auto graph = read_graph("VERTEX_SE3:QUAT 7 1 2 3 0 0 0.60006 0.80008\n");
  REQUIRE(graph.vertices.size() == 1);
  const SE3& T = graph.vertices[0].T_world_kf;
  CHECK(T.translation() == Eigen::Vector3d(1, 2, 3));
  CHECK(angle_of(T.linear()) == Approx(2.0 * std::acos(0.8)));
  CHECK((T.linear() * T.linear().transpose()).isIdentity(1e-14));
}

TEST_CASE("A key is a gtsam symbol, a plain number, or robot and index") {
  CHECK(keyframe_of_key(6989586621679009792U) == KeyframeId{0, 0});  // a0
  CHECK(keyframe_of_key(7061644215716937729U) == KeyframeId{1, 1});  // b1
  CHECK(keyframe_of_key((std::uint64_t{'A'} << 56U) | 5U) == KeyframeId{26, 5});
  CHECK(keyframe_of_key(1234) == KeyframeId{0, 1234});
  CHECK(keyframe_of_key(std::uint64_t{'!'} << 56U) == std::nullopt);
  CHECK(keyframe_of_key((std::uint64_t{'a'} << 56U) | (1ULL << 32U)) == std::nullopt);
  CHECK(keyframe_of_key(1ULL << 48U) == std::nullopt);
  for (const unsigned number : {0U, 25U, 26U, 51U, 52U, 1000U, 65535U})
    for (const std::uint32_t index : {0U, 1U, 0xffffffffU}) {
      const auto robot = static_cast<RobotId>(number);
      CAPTURE(robot, index);
      CHECK(keyframe_of_key(key_of_keyframe({robot, index})) == KeyframeId{robot, index});
    }
}

TEST_CASE("A graph is unchanged after writing and reading it") {
  const unsigned seed = GENERATE(range(0U, 5U));
  CAPTURE(seed);
  std::mt19937 rng(seed);
  G2oGraph graph;
  for (std::uint32_t i = 0; i < 4; ++i) graph.vertices.push_back({{60, i}, random_pose(rng)});
  for (std::uint32_t i = 0; i < 3; ++i)
    graph.edges.push_back({{60, i}, {3, i}, random_pose(rng), random_covariance(rng, 0.1)});

  std::stringstream file;
  write_g2o(file, graph);
  const G2oGraph back = parse_g2o(file.str(), "written");

  REQUIRE(back.vertices.size() == 4);
  REQUIRE(back.edges.size() == 3);
  for (std::size_t i = 0; i < 4; ++i) {
    CHECK(back.vertices[i].id == graph.vertices[i].id);
    CHECK(back.vertices[i].T_world_kf.isApprox(graph.vertices[i].T_world_kf, 1e-14));
  }
  for (std::size_t i = 0; i < 3; ++i) {
    CHECK(back.edges[i].from == graph.edges[i].from);
    CHECK(back.edges[i].to == graph.edges[i].to);
    CHECK(back.edges[i].T_from_to.isApprox(graph.edges[i].T_from_to, 1e-14));
    // The matrix is inverted twice: error of the condition number (below 1e4) times the rounding of
    // a double.
    CHECK(back.edges[i].covariance.isApprox(graph.edges[i].covariance, 1e-11));
  }
}

TEST_CASE("Verticals are unchanged after writing and reading them") {
  const unsigned seed = GENERATE(range(0U, 5U));
  CAPTURE(seed);
  std::mt19937 rng(seed);
  G2oGraph graph;
  for (const Eigen::Vector3d& up :
       {random_vector<3>(rng).normalized().eval(), random_vector<3>(rng).normalized().eval(),
        Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(0, 0, -1)}) {
    const auto index = static_cast<std::uint32_t>(graph.verticals.size());
    graph.verticals.push_back({{3, index}, {up, 0.004 * (index + 1.0)}});
  }
  std::stringstream file;
  write_g2o(file, graph);
  const G2oGraph back = parse_g2o(file.str(), "written");
  REQUIRE(back.verticals.size() == 4);
  for (std::size_t i = 0; i < 4; ++i) {
    CHECK(back.verticals[i].id == graph.verticals[i].id);
    CHECK(back.verticals[i].vertical.up_body.isApprox(graph.verticals[i].vertical.up_body, 1e-14));
    CHECK(back.verticals[i].vertical.sigma_rad == Approx(graph.verticals[i].vertical.sigma_rad));
  }
}

const std::string kOffset = "PARAMS_SE3OFFSET 4 0 0 0 0 0 0 1\n";

TEST_CASE("A prior on the tilt of a pose is its vertical, for any heading") {
  // Rotated by 90 degrees about x: z of the world is y of the pose. Heading and position are
  // arbitrary.
  const std::string information = " 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 25 0 0 0 0 25";
  const auto graph = read_graph(kVertex + kOffset + "EDGE_SE3_PRIOR 0 4 7 8 9 " +
                                "0.70710678 0 0 0.70710678" + information + '\n');
  REQUIRE(graph.verticals.size() == 1);
  CHECK(graph.verticals[0].id == KeyframeId{0, 0});
  CHECK(graph.verticals[0].vertical.up_body.isApprox(Eigen::Vector3d::UnitY(), 1e-7));
  CHECK(graph.verticals[0].vertical.sigma_rad == Approx(0.2));
}

TEST_CASE("Other priors than verticals are refused with the line and the reason") {
  const std::string pose = " 0 0 0 0 0 0 1";
  const std::string level = " 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 9 0 0 9 0 0\n";
  const auto [lines, reason] = GENERATE_COPY(table<std::string, std::string>({
      {"EDGE_SE3_PRIOR 0 4" + pose + " 1 0 0 0 0 0 1 0 0 0 0 1 0 0 0 9 0 0 9 0 0",
       "not a vertical"},
      {"EDGE_SE3_PRIOR 0 4" + pose + " 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 9 0 0 9 0 9",
       "not a vertical"},
      {"EDGE_SE3_PRIOR 0 4" + pose + " 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 9 0 0 4 0 0",
       "not a vertical"},
      {"EDGE_SE3_PRIOR 0 4" + pose + " 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 9 0 9",
       "not a vertical"},
      {"EDGE_SE3_PRIOR 0 4" + pose + " 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0",
       "not a vertical"},
      {"EDGE_SE3_PRIOR 0 4" + pose + " 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 -9 0 0 -9 0 0",
       "not a vertical"},
      {"EDGE_SE3_PRIOR 0 5" + pose + level, "no PARAMS_SE3OFFSET 5"},
      {"PARAMS_SE3OFFSET 0 0.1 0 0 0 0 0 1", "offset 0 is not the identity"},
      {"PARAMS_SE3OFFSET 0 0 0 0 0 0 0", "line ends before quaternion"},
      {"EDGE_SE3_PRIOR 0 4" + pose + " 0 0 0", "line ends before information"},
  }));
  CAPTURE(lines);
  CHECK_THROWS_WITH(read_graph(kVertex + kOffset + lines + '\n'),
                    StartsWith("test.g2o:3: ") && Contains(reason));
  const std::string vertical = "EDGE_SE3_PRIOR 0 4" + pose + level;
  CHECK_THROWS_WITH(read_graph(kVertex + kOffset + vertical + vertical),
                    "test.g2o:4: second prior on 0:0");
  CHECK_THROWS_WITH(read_graph("VERTEX_SE2 0 0 0 0\n" + kOffset),
                    "test.g2o:2: 2D and 3D in one file");
}

TEST_CASE("A vertical that is not a unit vector is not written") {
  const auto [up, sigma] = GENERATE(table<Eigen::Vector3d, double>({{{0, 0, 2}, 0.1},
                                                                    {{0, 0, 0}, 0.1},
                                                                    {{0, 0, 1}, 0.0},
                                                                    {{0, 0, 1}, NAN},
                                                                    {{0, NAN, 1}, 0.1}}));
  G2oGraph graph;
  graph.verticals.push_back({{2, 5}, {up, sigma}});
  std::ostringstream out;
  CHECK_THROWS_WITH(write_g2o(out, graph), Contains("vertical of 2:5"));
}

TEST_CASE("2D g2o is lifted to the plane z = 0") {
  const auto graph = read_graph("VERTEX_SE2 0 1 2 0.5\nEDGE_SE2 0 1 3 4 -0.25 2 0 0 4 0 8\n");
  CHECK(graph.dimension == 2);
  CHECK(graph.vertices.at(0).T_world_kf.translation() == Eigen::Vector3d(1, 2, 0));
  CHECK(graph.edges.at(0).T_from_to.linear()(1, 0) == Approx(std::sin(-0.25)));
  Vector6 diagonal;
  diagonal << 0, 0, 0.125, 0.5, 0.25, 0;
  CHECK(graph.edges[0].covariance.isApprox(Matrix6(diagonal.asDiagonal()), 1e-14));

  std::ostringstream out;
  CHECK_THROWS_AS(write_g2o(out, graph), std::invalid_argument);
}

TEST_CASE("A bad g2o file is refused with its line and the reason") {
  const auto [line, reason] = GENERATE(table<std::string, std::string>({
      {"VERTEX_XYZ 1 0 0 0", "unknown tag 'VERTEX_XYZ'"},
      {"0410268 0.7588833", "unknown tag '0410268'"},
      {"VERTEX_SE3:QUAT 1 0,5 0 0 0 0 0 1", "0'; are there decimal commas?"},
      {"EDGE_SE3:QUAT 0 1" + kPose + " 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0",
       "weigh rotation by 0: they are singular and"},
      {"EDGE_SE3:QUAT 0 1" + kPose + " 9 0 0 0 0 0 0 9 0 0 0 0 0 0 9 0 0 0 0 0 0 9",
       "more than the 21 numbers of its upper triangle"},
      {"VERTEX_SE3:QUAT 1 0 0 0 0 0 0", "line ends before quaternion"},
      {"VERTEX_SE3:QUAT 1 0 0 0 0 0 0 1 9", "more fields"},
      {"VERTEX_SE3:QUAT 0 0 0 0 0 0 0 1", "given twice"},
      {"VERTEX_SE3:QUAT 1 0 0 0 0 0 0 1.1", "quaternion has length"},
      {"VERTEX_SE3:QUAT 1 nan 0 0 0 0 0 1", "translation is not finite"},
      {"VERTEX_SE3:QUAT -1 0 0 0 0 0 0 1",
       "vertex id is not an integer from 0 to 9223372036854775807: '-1'"},
      {"VERTEX_SE3:QUAT 1x 0 0 0 0 0 0 1", "vertex id is not an integer"},
      {"VERTEX_SE3:QUAT 281474976710656 0 0 0 0 0 0 1", "names no robot"},
      {"VERTEX_SE2 1 0 0 0", "2D and 3D"},
      {"EDGE_SE3:QUAT 1 1" + kPose + kUnit, "edge from 0:1 to itself"},
      {"EDGE_SE3:QUAT 0 1" + kPose + " 0 0 0 0 0 0 1 0 0 0 0 1 0 0 0 1 0 0 1 0 1",
       "not positive definite"},
      {"EDGE_SE3:QUAT 0 1" + kPose + " 1 0 0 0 0 0 1 0 0 0 0 1 0 0 0 -0.4 0 0 1 0 1",
       "not positive definite, and its blocks weigh rotation by -6.0"},
      {"EDGE_SE3:QUAT 0 1" + kPose + " 1 0 0 0 0 0 1 0 0 0 0 -0.4 0 0 0 1 0 0 1 0 1",
       "weigh rotation by 1.000000 and translation by -6.0"},
      {"EDGE_SE3:QUAT 0 1" + kPose, "line ends before information"},
      {"EDGE_SE3:QUAT 0 1 1e308 0 0 0 0 0 1" + kUnit,
       "translation 1e+308 is outside -1e+06 .. 1e+06"},
      {"VERTEX_SE3:QUAT 1 0 1e300 0 0 0 0 1", "translation 1e+300 is outside"},
      {"EDGE_SE3:QUAT 0 1" + kPose + " 1e308 0 0 0 0 0 1e308 0 0 0 0 1e308 0 0 0 1 0 0 1 0 1",
       "its inverse has a variance of 1e-308, outside 1e-15 .. 1e+12"},
      {"EDGE_SE3:QUAT 0 1" + kPose + " 1e-13 0 0 0 0 0 1 0 0 0 0 1 0 0 0 1 0 0 1 0 1",
       "outside 1e-15 .. 1e+12"},
  }));
  CAPTURE(line);
  CHECK_THROWS_WITH(read_graph(kVertex + "# comment\n\nFIX 0\n" + line + '\n'),
                    StartsWith("test.g2o:5: ") && Contains(reason));
}

TEST_CASE("An edge with indefinite information has the weights of its blocks") {
  // As in cubicle.g2o: definite blocks with cross terms that are impossible in a covariance.
  const G2oGraph graph = read_graph("EDGE_SE3:QUAT 1 2" + kPose +
                                    " 4 2 0 0 0 0 4 0 0 0 0 10 70 100 0 10 0 0 10 0 5\n" +
                                    "EDGE_SE3:QUAT 2 3" + kPose + kUnit + '\n');
  CHECK(graph.indefinite_edges == 1);
  // tr(I_t^-1) = 8 / 12 + 1 / 10, tr(I_R^-1) = 2 / 10 + 1 / 5.
  const double tau = 3.0 / (8.0 / 12.0 + 0.1);
  const double kappa = 1.5 / 0.4;
  Vector6 variances;
  variances << Eigen::Vector3d::Constant(0.5 / kappa), Eigen::Vector3d::Constant(1.0 / tau);
  CHECK(graph.edges[0].covariance.isApprox(Matrix6(variances.asDiagonal()), 1e-14));

  const G2oGraph planar = read_graph("EDGE_SE2 0 1 1 0 0 4 0 9 4 0 16\n");
  CHECK(planar.indefinite_edges == 1);
  variances << 0.0, 0.0, 1.0 / 16.0, 0.25, 0.25, 0.0;
  CHECK(planar.edges[0].covariance.isApprox(Matrix6(variances.asDiagonal()), 1e-14));
}

TEST_CASE("An empty or missing g2o file is refused") {
  CHECK_THROWS_WITH(read_graph("# nothing\n"), "test.g2o: no vertex and no edge");
  CHECK_THROWS_WITH(read_g2o(fs::path("no/such.g2o")), "no/such.g2o: no such file");
}

TEST_CASE("The public benchmark graphs have the sizes their sources state") {
  const auto [name, dimension, poses, edges] =
      GENERATE(table<std::string, int, std::size_t, std::size_t>({
          {"3d/tinyGrid3D.g2o", 3, 9, 11},
          {"3d/smallGrid3D.g2o", 3, 125, 297},
          {"3d/sphere2500.g2o", 3, 2500, 4949},
          {"3d/parking-garage.g2o", 3, 1661, 6275},
          {"3d/torus3D.g2o", 3, 5000, 9048},
          {"2d/MIT.g2o", 2, 808, 827},
          {"2d/kitti_00.g2o", 2, 0, 4677},
      }));
  const auto file = shared_data("pose_graphs/" + name);
  if (!file) return;
  CAPTURE(name);
  const G2oGraph graph = read_g2o(*file);
  CHECK(graph.dimension == dimension);
  CHECK(graph.vertices.size() == poses);
  CHECK(graph.edges.size() == edges);
}

}  // namespace
}  // namespace km
