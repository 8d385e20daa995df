#include "test/support/pose_graph_problems.hpp"
#include "test/support/shared_data.hpp"
#include "test/support/test.hpp"

namespace km {

TEST_CASE("chordal initialisation returns exact poses") {
  std::mt19937 rng(3);
  std::vector<SE3> truth(1, SE3::Identity());
  WholeGraph graph{.poses = 8, .edges = {}};
  for (Eigen::Index i = 0; i + 1 < 8; ++i) {
    truth.push_back(truth.back() * random_pose(rng, 3.0));
    const auto k = static_cast<std::size_t>(i);
    graph.edges.push_back({i, i + 1, truth[k].inverse() * truth[k + 1], 2.0, 0.5});
  }
  graph.edges.push_back({7, 2, truth[7].inverse() * truth[2], 1.0, 5.0});
  const auto chordal = chordal_initialisation(8, graph.edges);
  for (std::size_t i = 0; i < 8; ++i) CHECK(chordal[i].isApprox(truth[i], 1e-9));
}

TEST_CASE("initialisation of a graph in two parts is refused") {
  const std::vector<PoseEdge> edges{{{0, 0}, {0, 1}}, {{0, 2}, {0, 3}}};
  CHECK_THROWS_AS(chordal_initialisation(4, edges), std::invalid_argument);
}

TEST_CASE("the chordal start of recorded graphs has the cost that dpgo reports") {
  // Costs of dpgo at its chordal start, which uses the same method. The files have rounded
  // quaternions.
  const auto [file, expected] = GENERATE(
      table<std::string, double>({{"smallGrid3D", 1561.38498}, {"sphere2500", 1971.17499}}));
  CAPTURE(file);
  const auto path = shared_data("pose_graphs/3d/" + file + ".g2o");
  if (!path) return;
  const WholeGraph graph = read_whole_graph(*path);
  const QuadraticProblem problem(3, graph.poses, graph.edges, {});
  const auto start = chordal_initialisation(graph.poses, graph.edges);
  CHECK(problem.cost(lift(start, 3)) == Approx(expected).epsilon(1e-4));
}

}  // namespace km
