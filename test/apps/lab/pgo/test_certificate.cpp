#include "apps/lab/pgo/certificate.hpp"

#include "apps/lab/pgo/solvers.hpp"
#include "modules/core/geometry/lie.hpp"
#include "modules/core/geometry/symmetric_eigen.hpp"
#include "modules/rbcd/stiefel.hpp"
#include "test/support/pose_graph_problems.hpp"
#include "test/support/shared_data.hpp"
#include "test/support/team_graphs.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

struct Known {
  const char* file;
  double optimum;  // certified by SE-Sync; parking-garage: by Levenberg-Marquardt with unit
                   // quaternions
  double tolerance = 2e-7;  // relative; SE-Sync does not normalise the rounded quaternions of the
                            // file
};

}  // namespace

TEST_CASE("[X z] S is half the Riemannian gradient of poses and vertical") {
  const unsigned seed = GENERATE(1U, 2U);
  const Eigen::Index rank = GENERATE(3, 5);
  CAPTURE(seed, rank);
  std::mt19937 rng(seed);
  const TeamGraph graph = noisy_chain(12, 1, 0.2, rng, 4.0);
  const QuadraticProblem problem = problem_of(graph, rank);
  const LiftedPoses X = random_lifted_poses(rng, rank, 12);
  const Eigen::VectorXd z = lifting_matrix(rank).col(2);
  LiftedPoses with_z = LiftedPoses::Zero(rank, 52);
  with_z.leftCols(48) = X;
  with_z.col(50) = z;
  const Eigen::MatrixXd product = with_z * certificate_matrix(problem, X);
  CHECK(product.leftCols(48).isApprox(0.5 * project_tangent(X, problem.euclidean_gradient(X)),
                                      1e-12));
  Eigen::VectorXd pull = Eigen::VectorXd::Zero(rank);
  for (const VerticalPrior& v : graph.verticals)
    pull += v.weight * (z - X.middleCols<3>(4 * v.pose) * v.up);
  CHECK((product.col(50) - (pull - z * z.dot(pull))).norm() < 1e-12 * pull.norm());
}

TEST_CASE("The optimum of a graph with verticals is certified, and its S is semidefinite") {
  const unsigned seed = GENERATE(1U, 2U, 3U);
  CAPTURE(seed);
  std::mt19937 rng(seed);
  const TeamGraph graph = noisy_chain(30, 1, 0.1, rng, 5.0);
  const auto start = levelled(chordal_initialisation(30, graph.edges), graph.verticals);
  const QuadraticProblem problem = problem_of(graph, 3);
  const LiftedPoses X =
      minimise(problem, lift(start, 3), {.max_iterations = 200, .gradient_tolerance = 1e-9}).X;
  LiftedPoses with_z = LiftedPoses::Zero(3, 124);
  with_z.leftCols(120) = X;
  with_z(2, 122) = 1.0;
  const Eigen::MatrixXd S = certificate_matrix(problem, X);
  CHECK((with_z * S).norm() < 1e-5);  // small against entries of up to 100; limited by the end of
                                      // the descent
  const double least = symmetric_eigen(S).values(0);
  CHECK(least > -1e-6);
  const Certificate certificate = certify(problem, X);
  CHECK(certificate.certified);
  CHECK(certificate.relative_gap < 1e-5);

  // The same poses after a common tilt cost more, and the gap of the certificate shows by how much.
  const double tilt = GENERATE(1e-3, 0.05);
  std::vector<SE3> tilted = round_to_poses(X, lifted_identity(3));
  for (SE3& T : tilted) T = make_pose(so3_exp({tilt, 0.0, 0.0}), Eigen::Vector3d::Zero()) * T;
  const LiftedPoses X_tilted = lift(tilted, 3);
  const double excess = 1.0 - problem.cost(X) / problem.cost(X_tilted);
  CHECK(excess > 0.0);
  CHECK(certify(problem, X_tilted).relative_gap == Approx(excess).epsilon(0.1).margin(1e-6));
}

TEST_CASE("Poses upside down have their known negative eigenvalue") {
  const Eigen::Index n = GENERATE(2, 7, 30);
  CAPTURE(n);
  constexpr double kWeight = 3.0;
  std::vector<BlockEdge> edges;
  std::vector<VerticalPrior> verticals;
  for (Eigen::Index i = 0; i < n; ++i) {
    if (i > 0) edges.push_back({i - 1, i, SE3::Identity(), 1.0, 1.0});
    verticals.push_back({i, Eigen::Vector3d::UnitZ(), kWeight});
  }
  const SE3 overhead =
      make_pose(Eigen::Vector3d(1.0, -1.0, -1.0).asDiagonal(), Eigen::Vector3d::Zero());
  const LiftedPoses X = lift(std::vector<SE3>(static_cast<std::size_t>(n), overhead), 3);
  const QuadraticProblem problem(3, n, edges, {}, verticals);
  CHECK(project_tangent(X, problem.euclidean_gradient(X)).norm() < 1e-12);
  // With all z axes changed by a, and the vertical by b, S gives -n w (a + b)^2, over the norm n
  // a^2 + b^2.
  const Certificate certificate = certify(problem, X);
  CHECK_FALSE(certificate.certified);
  CHECK(certificate.lambda_bound <= -kWeight * (static_cast<double>(n) + 1.0));
}

TEST_CASE("A ring wound once has its known negative eigenvalue") {
  const Eigen::Index n = GENERATE(5, 12, 40);
  CAPTURE(n);
  const WoundRing ring(n, 1);
  const QuadraticProblem problem(3, n, ring.graph.edges, {});
  const Certificate certificate = certify(problem, lift(ring.wound, 3));
  // S is the Laplacian of the ring minus 2 - 2 cos(2 pi / n) on two axes, so constant vectors have
  // that eigenvalue.
  const double expected = -2.0 + 2.0 * std::cos(2.0 * std::numbers::pi / static_cast<double>(n));
  CHECK_FALSE(certificate.certified);
  CHECK(certificate.lambda_bound <= expected);
  // The cost is n (4 - 4 cos) = -2n lambda_min. A bound 3n lambda_min below it is negative and
  // becomes 0.
  CHECK(certificate.relative_gap == 1.0);
}

TEST_CASE("The certified bound is below the smallest eigenvalue of the Schur complement") {
  const unsigned seed = GENERATE(1U, 2U, 3U);
  CAPTURE(seed);
  std::mt19937 rng(seed);
  const TeamGraph graph = noisy_chain(25, 1, 0.2, rng);
  const CentralOptimum optimum = central_optimum(graph);
  CHECK(optimum.certificate.certified);
  CHECK(optimum.certificate.relative_gap < 2e-8);
  // The Schur complement with dense matrices: one translation is held, the others are set to their
  // best values and then eliminated.
  const QuadraticProblem problem(3, 25, graph.edges, {});
  std::vector<Eigen::Index> turns, places;
  for (Eigen::Index k = 0; k < 100; ++k)
    if (k % 4 != 3)
      turns.push_back(k);
    else if (k > 3)
      places.push_back(k);
  const Eigen::MatrixXd Q = problem.data_matrix();
  const Eigen::LDLT<Eigen::MatrixXd> Q_places(Q(places, places));
  LiftedPoses X = lift(optimum.poses, 3);
  X.col(3).setZero();
  X(Eigen::all, places) =
      -Q_places.solve(Q(places, turns) * X(Eigen::all, turns).transpose()).transpose();
  const Eigen::MatrixXd S = certificate_matrix(problem, X);
  const Eigen::MatrixXd schur =
      S(turns, turns) - S(turns, places) * Q_places.solve(S(places, turns));
  CHECK(symmetric_eigen(schur).values(0) > optimum.certificate.lambda_bound);
}

TEST_CASE("The bound from any point is not above the optimal cost") {
  const unsigned seed = GENERATE(1U, 2U, 3U, 4U);
  const double vertical_weight = GENERATE(0.0, 4.0);
  CAPTURE(seed, vertical_weight);
  std::mt19937 rng(seed);
  const TeamGraph graph = noisy_chain(20, 1, 0.3, rng, vertical_weight);
  const double optimum = central_optimum(graph).cost;
  const QuadraticProblem problem = problem_of(graph, 3);
  LiftedPoses X = random_lifted_poses(rng, 3, 20);
  for (int step = 0; step < 10; ++step) {
    const Certificate certificate = certify(problem, X);
    CHECK(problem.cost(X) * (1.0 - certificate.relative_gap) <= optimum * (1.0 + 1e-9));
    X = minimise(problem, X, {.max_iterations = 2}).X;
  }
}

TEST_CASE("Recorded graphs are certified at their known optima") {
  const Known known = GENERATE(
      Known{"3d/tinyGrid3D.g2o", 18.5193868, 2e-6}, Known{"3d/smallGrid3D.g2o", 1025.39802},
      Known{"3d/parking-garage.g2o", 1.262524, 1e-6}, Known{"3d/sphere2500.g2o", 1687.00567},
      Known{"3d/torus3D.g2o", 24227.0415, 3e-7}, Known{"2d/CSAIL.g2o", 31.7037159},
      Known{"2d/MIT.g2o", 61.1541155}, Known{"2d/intel.g2o", 52.3482273},
      Known{"2d/manhattan.g2o", 6431.39139}, Known{"2d/city10000.g2o", 638.62462},
      Known{"2d/kitti_02.g2o", 108.351139}, Known{"2d/ais2klinik.g2o", 188.501807},
      Known{"3d/cubicle.g2o", 717.125991});
  const auto file = shared_data(std::string("pose_graphs/") + known.file);
  if (!file) return;
  CAPTURE(known.file);
  const TeamGraph graph = partition_contiguously(read_g2o(*file), 1, known.file);
  const CentralOptimum optimum = central_optimum(graph);
  CHECK(optimum.cost == Approx(known.optimum).epsilon(known.tolerance));
  CAPTURE(optimum.certificate.relative_gap);
  CHECK(optimum.certificate.certified);
}

}  // namespace km
