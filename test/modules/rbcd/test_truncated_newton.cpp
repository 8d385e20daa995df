#include "modules/rbcd/block_cholesky.hpp"
#include "modules/rbcd/stiefel.hpp"
#include "test/support/pose_graph_problems.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

WholeGraph exact_triangle(const std::vector<SE3>& truth) {
  WholeGraph graph{.poses = 3, .edges = {}};
  for (const auto& [i, j] : std::initializer_list<std::pair<int, int>>{{0, 1}, {1, 2}, {0, 2}})
    graph.edges.push_back(
        {i, j, truth[static_cast<std::size_t>(i)].inverse() * truth[static_cast<std::size_t>(j)],
         2.0, 3.0});
  return graph;
}

TEST_CASE("a block with exact measurements converges from any start") {
  const unsigned seed = GENERATE(1U, 2U, 3U, 4U);
  CAPTURE(seed);
  std::mt19937 rng(seed);
  std::vector<SE3> truth(1, SE3::Identity());
  for (int i = 0; i < 2; ++i) truth.push_back(random_pose(rng));
  const WholeGraph graph = exact_triangle(truth);
  QuadraticProblem problem(5, 3, graph.edges, {});
  const auto result = minimise(problem, random_lifted_poses(rng, 5, 3),
                               {.max_iterations = 200, .gradient_tolerance = 1e-9});
  CHECK(result.cost < 1e-12);
  const auto poses = round_to_poses(result.X, result.X.leftCols<4>());
  for (std::size_t i = 0; i < 3; ++i) CHECK(poses[i].isApprox(truth[i], 1e-6));
}

TEST_CASE("steps never increase the cost and keep the poses feasible") {
  const unsigned seed = GENERATE(1U, 2U, 3U);
  CAPTURE(seed);
  std::mt19937 rng(seed);
  WholeGraph graph{.poses = 20, .edges = {}};
  for (Eigen::Index i = 0; i < 20; ++i)
    for (const Eigen::Index step : {1, 5})
      graph.edges.push_back({i, (i + step) % 20, random_pose(rng), 1.0, 1.0});
  QuadraticProblem problem(4, 20, graph.edges, {});
  LiftedPoses X = random_lifted_poses(rng, 4, 20);
  double cost = problem.cost(X);
  for (int step = 0; step < 30; ++step) {
    auto result = minimise(problem, X, {.max_iterations = 1});
    CHECK(result.initial_cost == cost);
    CHECK(result.cost <= cost);
    CHECK(problem.cost(result.X) == result.cost);
    CHECK(stiefel_error(result.X) < 1e-10);
    cost = result.cost;
    X = std::move(result.X);
  }
}

TEST_CASE("the relaxation unwinds a ring that rigid poses cannot unwind") {
  // Equal poses on a ring, with one full turn at the start. This closed geodesic cannot be
  // contracted in SO(3), but St(3, 5) is simply connected.
  constexpr Eigen::Index kPoses = 24;
  WholeGraph ring{.poses = kPoses, .edges = {}};
  std::vector<SE3> wound;
  for (Eigen::Index i = 0; i < kPoses; ++i) {
    ring.edges.push_back({i, (i + 1) % kPoses, SE3::Identity(), 1.0, 1.0});
    const Eigen::AngleAxisd R(2.0 * M_PI * static_cast<double>(i) / kPoses,
                              Eigen::Vector3d::UnitZ());
    wound.push_back(make_pose(R.toRotationMatrix(), Eigen::Vector3d::Zero()));
  }
  const auto lowest_cost = [&](Eigen::Index rank, double sigma) {
    std::mt19937 rng(1);
    const QuadraticProblem problem(rank, kPoses, ring.edges, {});
    return minimise(problem, perturb_rotations(lift(wound, rank), sigma, rng),
                    {.max_iterations = 500})
        .cost;
  };
  const double wound_cost = lowest_cost(3, 0.0);
  CHECK(wound_cost > 1.0);
  CHECK(lowest_cost(3, 1e-3) == Approx(wound_cost));
  CHECK(lowest_cost(5, 0.0) == Approx(wound_cost));
  CHECK(lowest_cost(5, 1e-3) < 1e-6);
}

constexpr double kRounding = 1e-12;

TEST_CASE("nearest_stiefel has orthonormal columns and is the nearest") {
  const unsigned seed = GENERATE(1U, 2U, 3U);
  CAPTURE(seed);
  std::mt19937 rng(seed);
  std::normal_distribution<double> normal;
  Eigen::MatrixXd M(5, 3);
  for (double& m : M.reshaped()) m = normal(rng);
  const Eigen::MatrixXd Y = nearest_stiefel(M);
  CHECK((Y.transpose() * Y - Eigen::Matrix3d::Identity()).norm() < kRounding);
  for (int trial = 0; trial < 50; ++trial) {
    Eigen::MatrixXd other = Y;
    for (double& o : other.reshaped()) o += 0.1 * normal(rng);
    CHECK((nearest_stiefel(other) - M).norm() >= (Y - M).norm() - kRounding);
  }
}

// A random definite matrix; its entries are in blocks of 4 x 4, as for poses, or single.
Eigen::SparseMatrix<double> random_definite(int size, int block, std::mt19937& rng) {
  std::normal_distribution<double> normal;
  std::uniform_int_distribution<int> place(0, size / block - 1);
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(size, size);
  for (int n = 0; n < 2 * size / block; ++n) {
    Eigen::MatrixXd J = Eigen::MatrixXd::Zero(block, size);
    const int i = place(rng);
    const int j = place(rng);
    for (double& x : J.middleCols(i * block, block).reshaped()) x = normal(rng);
    for (double& x : J.middleCols(j * block, block).reshaped()) x = normal(rng);
    A += J.transpose() * J;
  }
  A.diagonal().array() += 0.1;
  return A.sparseView();
}

TEST_CASE("The factor solves for rows of the right-hand side with any pattern") {
  const int block = GENERATE(1, 2, 4);
  const int poses = GENERATE(1, 2, 7, 40);
  const Eigen::Index rank = GENERATE(1, 3, 4, 5);
  const unsigned seed = GENERATE(1U, 2U, 3U);
  CAPTURE(block, poses, rank, seed);
  std::mt19937 rng(seed);
  std::normal_distribution<double> normal;
  const Eigen::SparseMatrix<double> A = random_definite(4 * poses, block, rng);
  Eigen::MatrixXd B(rank, 4 * poses);
  for (double& x : B.reshaped()) x = normal(rng);
  const Eigen::MatrixXd X = BlockCholesky(A).solve_rows(B);
  // The smallest eigenvalue is at least 0.1, the largest about 100.
  CHECK((X * A - B).norm() < 1e-10 * B.norm());
}

TEST_CASE("An indefinite matrix is not factorised") {
  Eigen::SparseMatrix<double> A(4, 4);
  A.setIdentity();
  A.coeffRef(2, 2) = -1.0;
  CHECK_THROWS_WITH(BlockCholesky(A), Contains("4 rows is not positive definite"));
}

}  // namespace
}  // namespace km
