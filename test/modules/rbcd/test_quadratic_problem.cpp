#include "modules/rbcd/quadratic_problem.hpp"
#include "test/support/pose_graph_problems.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

constexpr Eigen::Index kPoses = 6;
constexpr Eigen::Index kFixed = 3;

// A chain with closures, and edges in both directions to fixed poses.
QuadraticProblem random_problem(std::mt19937& rng, Eigen::Index rank) {
  std::uniform_real_distribution<double> weight(0.5, 5.0);
  std::vector<BlockEdge> edges;
  const auto add = [&](Eigen::Index i, Eigen::Index j) {
    const double kappa = weight(rng);
    const double tau = weight(rng);
    edges.push_back({i, j, random_pose(rng, 2.0), kappa, tau});
  };
  for (Eigen::Index i = 0; i + 1 < kPoses; ++i) add(i, i + 1);
  add(4, 1);
  add(0, 5);
  std::vector<PublicEdge> public_edges;
  for (const auto& [own, fixed, from_own] :
       std::initializer_list<std::tuple<int, int, bool>>{{1, 0, true}, {1, 2, false}, {5, 1, true}})
    public_edges.push_back({own, fixed, from_own, random_pose(rng, 2.0), 2.0, 3.0});
  QuadraticProblem problem(rank, kPoses, edges, public_edges);
  problem.set_fixed(random_lifted_poses(rng, rank, kFixed));
  return problem;
}

LiftedPoses random_direction(std::mt19937& rng, const LiftedPoses& X) {
  return project_tangent(X, random_lifted_poses(rng, X.rows(), pose_count(X)));
}

}  // namespace

TEST_CASE("the cost is the sum of squared residuals") {
  std::mt19937 rng(1);
  const QuadraticProblem problem = random_problem(rng, 3);
  const LiftedPoses X = random_lifted_poses(rng, 3, kPoses);
  double expected = 0.0;
  const auto add = [&](const Eigen::MatrixXd& A, const Eigen::MatrixXd& B, const SE3& T,
                       double kappa, double tau) {
    expected += kappa * (B.leftCols<3>() - A.leftCols<3>() * T.linear()).squaredNorm();
    expected += tau * (B.col(3) - A.col(3) - A.leftCols<3>() * T.translation()).squaredNorm();
  };
  for (const BlockEdge& e : problem.edges())
    add(X.middleCols<4>(4 * e.i), X.middleCols<4>(4 * e.j), e.T_i_j, e.kappa, e.tau);
  for (const PublicEdge& e : problem.public_edges()) {
    const Eigen::MatrixXd own = X.middleCols<4>(4 * e.own);
    const Eigen::MatrixXd fixed = problem.fixed().middleCols<4>(4 * e.fixed);
    e.from_own ? add(own, fixed, e.T, e.kappa, e.tau) : add(fixed, own, e.T, e.kappa, e.tau);
  }
  CHECK(problem.cost(X) == Approx(expected).epsilon(1e-12));
}

TEST_CASE("gradient and Hessian agree with finite differences along retractions") {
  const Eigen::Index rank = GENERATE(3, 4, 5);
  const unsigned seed = GENERATE(1U, 2U, 3U);
  CAPTURE(rank, seed);
  std::mt19937 rng(seed);
  const QuadraticProblem problem = random_problem(rng, rank);
  const LiftedPoses X = random_lifted_poses(rng, rank, kPoses);
  const LiftedPoses V = random_direction(rng, X);
  const LiftedPoses euclidean = problem.euclidean_gradient(X);
  const double slope = project_tangent(X, euclidean).cwiseProduct(V).sum();
  const double curvature = problem.hessian_product(X, euclidean, V).cwiseProduct(V).sum();
  const double h = 1e-3;  // truncation h^2 against rounding 1e-16 / h^2
  const double plus = problem.cost(retract(X, h * V));
  const double minus = problem.cost(retract(X, -h * V));
  const double scale = std::abs(slope) + std::abs(curvature) + 1.0;
  CHECK(std::abs((plus - minus) / (2.0 * h) - slope) < 1e-4 * scale);
  CHECK(std::abs((plus - 2.0 * problem.cost(X) + minus) / (h * h) - curvature) < 1e-4 * scale);
}

TEST_CASE("the Hessian is symmetric and the preconditioner positive definite") {
  std::mt19937 rng(7);
  const QuadraticProblem problem = random_problem(rng, 5);
  const LiftedPoses X = random_lifted_poses(rng, 5, kPoses);
  const LiftedPoses euclidean = problem.euclidean_gradient(X);
  const LiftedPoses U = random_direction(rng, X);
  const LiftedPoses V = random_direction(rng, X);
  const double UHV = problem.hessian_product(X, euclidean, V).cwiseProduct(U).sum();
  const double VHU = problem.hessian_product(X, euclidean, U).cwiseProduct(V).sum();
  CHECK(UHV == Approx(VHU).epsilon(1e-10));
  CHECK(problem.precondition(X, V).cwiseProduct(V).sum() > 0.0);
  CHECK(problem.precondition(X, V).cwiseProduct(U).sum() ==
        Approx(problem.precondition(X, U).cwiseProduct(V).sum()).epsilon(1e-10));
}

TEST_CASE("a problem refuses edges without poses, infinite ones and missing poses") {
  const double inf = std::numeric_limits<double>::infinity();
  const auto make = [](std::vector<BlockEdge> edges, std::vector<PublicEdge> public_edges) {
    return QuadraticProblem(5, 2, std::move(edges), std::move(public_edges));
  };
  CHECK_THROWS_AS(make({{0, 2, SE3::Identity(), 1, 1}}, {}), std::invalid_argument);
  CHECK_THROWS_AS(make({{1, 1, SE3::Identity(), 1, 1}}, {}), std::invalid_argument);
  CHECK_THROWS_AS(make({{0, 1, SE3::Identity(), inf, 1}}, {}), std::invalid_argument);
  CHECK_THROWS_AS(make({{0, 1, SE3::Identity(), 1, 0}}, {}), std::invalid_argument);
  SE3 T = SE3::Identity();
  T.translation().x() = inf;
  CHECK_THROWS_AS(make({{0, 1, T, 1, 1}}, {}), std::invalid_argument);
  CHECK_THROWS_AS(make({}, {{2, 0, true, SE3::Identity(), 1, 1}}), std::invalid_argument);
  QuadraticProblem problem = make({}, {{1, 3, true, SE3::Identity(), 1, 1}});
  CHECK_THROWS_AS(problem.set_fixed(LiftedPoses::Zero(5, 12)), std::invalid_argument);
  CHECK_THROWS_AS(problem.set_fixed(LiftedPoses::Zero(3, 16)), std::invalid_argument);
}

TEST_CASE("vertical priors of a block are part of its cost, gradient and Hessian") {
  const Eigen::Index rank = GENERATE(3, 5);
  std::mt19937 rng(2);
  const std::vector<BlockEdge> edges{{0, 1, random_pose(rng), 2.0, 3.0},
                                     {1, 2, random_pose(rng), 1.0, 0.5}};
  const std::vector<VerticalPrior> priors{{0, random_vector<3>(rng).normalized(), 4.0},
                                          {2, random_vector<3>(rng).normalized(), 0.7}};
  const QuadraticProblem with(rank, 3, edges, {}, priors);
  const QuadraticProblem without(rank, 3, edges, {});
  const LiftedPoses X = random_lifted_poses(rng, rank, 3);
  double expected = without.cost(X);
  for (const VerticalPrior& v : priors) expected += vertical_cost(v, X.middleCols<3>(4 * v.pose));
  CHECK(with.cost(X) == Approx(expected).epsilon(1e-12));
  const LiftedPoses gradient = with.euclidean_gradient(X);
  constexpr double h = 1e-4;
  for (int k = 0; k < 5; ++k) {
    const LiftedPoses V = project_tangent(X, random_lifted_poses(rng, rank, 3));
    const double up = with.cost(retract(X, h * V));
    const double down = with.cost(retract(X, -h * V));
    CHECK((up - down) / (2.0 * h) == Approx(gradient.cwiseProduct(V).sum()).margin(1e-4));
    CHECK((up - 2.0 * with.cost(X) + down) / (h * h) ==
          Approx(with.hessian_product(X, gradient, V).cwiseProduct(V).sum()).margin(1e-2));
  }
  const auto make = [&](VerticalPrior v) { return QuadraticProblem(rank, 3, edges, {}, {v}); };
  CHECK_THROWS_AS(make({3, Eigen::Vector3d::UnitZ(), 1.0}), std::invalid_argument);
  CHECK_THROWS_AS(make({0, Eigen::Vector3d::UnitZ(), 0.0}), std::invalid_argument);
  CHECK_THROWS_AS(make({0, Eigen::Vector3d::Constant(NAN), 1.0}), std::invalid_argument);
}

}  // namespace km
