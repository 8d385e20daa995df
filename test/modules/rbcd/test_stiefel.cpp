#include <catch2/catch.hpp>

#include "modules/core/lie.hpp"
#include "modules/rbcd/stiefel.hpp"
#include "test/support/pose_graph_problems.hpp"

namespace km {
namespace {

constexpr double kRounding = 1e-12;

LiftedPoses random_tangent(std::mt19937& rng, const LiftedPoses& X) {
  std::normal_distribution<double> normal;
  LiftedPoses V(X.rows(), X.cols());
  for (double& v : V.reshaped()) v = normal(rng);
  return project_tangent(X, V);
}

}  // namespace

TEST_CASE("nearest_stiefel has orthonormal columns and is the nearest", "[rbcd]") {
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

TEST_CASE("the projected vector is tangent and the rest is normal", "[rbcd]") {
  std::mt19937 rng(4);
  const Eigen::Index rank = GENERATE(3, 4, 5);
  const LiftedPoses X = random_lifted_poses(rng, rank, 7);
  std::normal_distribution<double> normal;
  LiftedPoses W(X.rows(), X.cols());
  for (double& w : W.reshaped()) w = normal(rng);
  const LiftedPoses V = project_tangent(X, W);
  for (Eigen::Index i = 0; i < 7; ++i) {
    const Eigen::Matrix3d S = X.middleCols<3>(4 * i).transpose() * V.middleCols<3>(4 * i);
    CHECK((S + S.transpose()).norm() < kRounding);
  }
  CHECK(std::abs((W - V).cwiseProduct(random_tangent(rng, X)).sum()) < kRounding * 100);
  CHECK((project_tangent(X, V) - V).norm() < kRounding);
}

TEST_CASE("the retraction is feasible and of second order", "[rbcd]") {
  std::mt19937 rng(5);
  const LiftedPoses X = random_lifted_poses(rng, 5, 3);
  const LiftedPoses V = random_tangent(rng, X);
  CHECK(stiefel_error(retract(X, V)) < kRounding);
  CHECK((retract(X, 0.0 * V) - X).norm() < kRounding);
  // d/dh at 0 is V. The second difference is normal to the manifold, so its projection is zero.
  const double h = 1e-4;
  const LiftedPoses plus = retract(X, h * V);
  const LiftedPoses minus = retract(X, -h * V);
  CHECK(((plus - minus) / (2.0 * h) - V).norm() < 1e-6);
  CHECK(project_tangent(X, (plus - 2.0 * X + minus) / (h * h)).norm() < 1e-6);
}

}  // namespace km
