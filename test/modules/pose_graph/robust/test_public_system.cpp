#include <Eigen/Cholesky>
#include <algorithm>
#include <catch2/catch.hpp>

#include "modules/pose_graph/robust/loose_links.hpp"
#include "modules/pose_graph/robust/public_system.hpp"
#include "test/support/random_pose.hpp"

namespace km {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kPoses = 60;  // public ones, of each of two robots

// Two robots that move beside each other, with a link between every second pair of poses, and
// `loose` links between places where no other link is near.
GncHellos two_robots(std::mt19937& rng, int loose) {
  GncHellos hellos;
  for (const RobotId robot : {RobotId{3}, RobotId{8}}) {
    GncHello& hello = hellos[robot];
    hello.robot = robot;
    for (int k = 0; k < kPoses; ++k) {
      hello.poses.push_back(static_cast<KeyframeIndex>(2 * k));
      hello.T_start_pose.push_back(random_pose(rng));
      if (k > 0) hello.pairs.push_back({k - 1, k});
    }
  }
  const auto link = [&](int a, int b) {
    const GncHello& own = hellos[3];
    const GncHello& other = hellos[8];
    const SE3 T = own.T_start_pose[static_cast<std::size_t>(a)].inverse() *
                  other.T_start_pose[static_cast<std::size_t>(b)];
    hellos[3].links.push_back({.own = own.poses[static_cast<std::size_t>(a)],
                               .other = {8, other.poses[static_cast<std::size_t>(b)]},
                               .T_from_to = T * random_pose(rng, 0.1),
                               .kappa = 2.0,
                               .tau = 3.0});
  };
  for (int k = 0; k < kPoses; k += 2) link(k, k);
  for (int a = 0; a < kPoses && loose > 0; a += 5)
    for (int b = 0; b < kPoses && loose > 0; b += 5)
      if (std::abs(a - b) > 5) {
        link(a, b);
        --loose;
      }
  return hellos;
}

// A positive definite matrix with the pattern that a robot tells.
BlockMatrix random_part(std::mt19937& rng, std::size_t pairs) {
  BlockMatrix part = BlockMatrix::zero(6, kPoses, pairs);
  for (int k = 0; k < kPoses; ++k) part.at(k) = 30.0 * random_covariance(rng, 1.0);
  for (std::size_t p = 0; p < pairs; ++p)
    part.between(static_cast<int>(p)) = 0.1 * random_covariance(rng, 1.0);
  return part;
}

// The whole system as a dense matrix, its links by Gauss-Newton.
MatrixXd dense(const PublicGraph& graph, const std::map<RobotId, BlockMatrix>& parts,
               const std::vector<SE3>& poses, const std::vector<double>& weights, VectorXd& slope) {
  MatrixXd A = MatrixXd::Zero(6 * graph.nodes(), 6 * graph.nodes());
  const auto add = [&](Index i, Index j, const MatrixXd& H) {
    A.block<6, 6>(6 * i, 6 * j) += H;
    if (i != j) A.block<6, 6>(6 * j, 6 * i) += H.transpose();
  };
  for (const auto& [robot, part] : parts) {
    const int first = graph.first(robot);
    for (int k = 0; k < kPoses; ++k) add(first + k, first + k, part.at(k));
    for (std::size_t p = 0; p < graph.pairs(robot).size(); ++p)
      add(graph.pairs(robot)[p][0], graph.pairs(robot)[p][1], part.between(static_cast<int>(p)));
  }
  slope = VectorXd::Zero(A.rows());
  for (std::size_t k = 0; k < weights.size(); ++k) {
    BlockEdge e = graph.links()[k];
    e.kappa *= weights[k];
    e.tau *= weights[k];
    const EdgeModel model =
        model_edge(e, poses[static_cast<std::size_t>(e.i)], poses[static_cast<std::size_t>(e.j)],
                   Curvature::kGaussNewton);
    add(e.i, e.i, model.H_ii);
    add(e.j, e.j, model.H_jj);
    add(e.i, e.j, model.H_ij);
    slope.segment<6>(6 * e.i) -= model.g_i;
    slope.segment<6>(6 * e.j) -= model.g_j;
  }
  return A;
}

TEST_CASE("the team's equations have the solution of the dense matrix", "[gnc]") {
  const int loose = GENERATE(0, 60);
  CAPTURE(loose);
  std::mt19937 rng(19);
  const GncHellos hellos = two_robots(rng, loose);
  const auto graph = std::make_shared<const PublicGraph>(hellos);
  const std::vector<bool> is_loose = loose_links(*graph);
  CHECK(std::count(is_loose.begin(), is_loose.end(), true) == loose);
  std::vector<SE3> poses;
  for (const auto& [robot, hello] : hellos)
    poses.insert(poses.end(), hello.T_start_pose.begin(), hello.T_start_pose.end());
  std::uniform_real_distribution<double> weight(0.1, 1.0);
  std::vector<double> weights;
  for (std::size_t k = 0; k < graph->links().size(); ++k) weights.push_back(weight(rng));

  PublicSystem system(graph, 3);
  std::map<RobotId, BlockMatrix> parts;
  for (const auto& [robot, hello] : hellos) {
    parts[robot] = random_part(rng, hello.pairs.size());
    system.set_part(robot, parts[robot]);
  }
  REQUIRE(system.factorise(poses, weights, Curvature::kGaussNewton));
  VectorXd reduced(6 * graph->nodes());
  for (Index k = 0; k < reduced.size(); ++k) reduced(k) = weight(rng);
  const PublicSystem::Solution solution = system.solve(reduced, 1e-12);
  CHECK((solution.iterations > 0) == (loose > 0));

  VectorXd slope;
  MatrixXd A = dense(*graph, parts, poses, weights, slope);
  VectorXd C = reduced + slope;
  const Index held = 6 * (graph->nodes() / 2);
  A.middleRows<6>(held).setZero();
  A.middleCols<6>(held).setZero();
  A.block<6, 6>(held, held).setIdentity();
  C.segment<6>(held).setZero();
  const VectorXd expected = A.ldlt().solve(C);
  // Conjugate gradients end at a residual of 1e-12; the condition is below 1e4.
  CHECK((solution.x.reshaped() - expected).norm() < 1e-7 * expected.norm());
  CHECK(solution.decrement == Approx(C.dot(expected)).epsilon(1e-7));
}

TEST_CASE("robots whose parts are indefinite are told so, not solved for", "[gnc]") {
  std::mt19937 rng(23);
  const GncHellos hellos = two_robots(rng, 0);
  const auto graph = std::make_shared<const PublicGraph>(hellos);
  std::vector<SE3> poses(static_cast<std::size_t>(graph->nodes()), SE3::Identity());
  PublicSystem system(graph, 3);
  for (const auto& [robot, hello] : hellos) {
    BlockMatrix part = random_part(rng, hello.pairs.size());
    part.at(1) *= -1.0;
    system.set_part(robot, part);
  }
  const std::vector<double> none(graph->links().size(), 0.0);
  CHECK(!system.factorise(poses, none, Curvature::kFull));
  CHECK_THROWS_AS(system.set_part(3, BlockMatrix::zero(6, kPoses, 2)), std::invalid_argument);
}

TEST_CASE("a link is loose unless one of the same robots runs beside it", "[gnc]") {
  std::mt19937 rng(29);
  const GncHellos hellos = two_robots(rng, 40);
  const PublicGraph graph(hellos);
  const std::vector<bool> loose = loose_links(graph);
  for (std::size_t k = 0; k < loose.size(); ++k) {
    CAPTURE(k);
    CHECK(loose[k] == (k >= kPoses / 2));  // those come last
  }
  // As few as 32 fill up no factorisation.
  const PublicGraph few(two_robots(rng, 32));
  const std::vector<bool> none = loose_links(few);
  CHECK(std::count(none.begin(), none.end(), true) == 0);
}

TEST_CASE("a robot that only loose links, or none with a weight, join is held", "[gnc]") {
  std::mt19937 rng(31);
  const PublicGraph graph(two_robots(rng, 40));
  const std::vector<bool> loose = loose_links(graph);
  std::vector<double> weights(loose.size(), 1.0);
  CHECK(nodes_to_hold(graph, loose, weights).empty());
  for (std::size_t k = 0; k < loose.size(); ++k)
    if (!loose[k]) weights[k] = 0.0;
  // The middle node is the first one of robot 8: of robot 3 one is to be held.
  CHECK(nodes_to_hold(graph, loose, weights) == std::vector<int>{graph.first(3)});
  CHECK(nodes_to_hold(graph, std::vector<bool>(loose.size(), true),
                      std::vector<double>(loose.size(), 1.0)) == std::vector<int>{graph.first(3)});
}

}  // namespace
}  // namespace km
