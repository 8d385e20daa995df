#include <Eigen/Cholesky>
#include <catch2/catch.hpp>

#include "modules/vio/marginalization.hpp"
#include "test/support/random_pose.hpp"

namespace km {
namespace {

constexpr int kSize = 12, kTaken = 5;

struct Quadratic {
  Eigen::MatrixXd H;
  Eigen::VectorXd g;
};

Quadratic random_quadratic(unsigned seed, int rows) {
  std::mt19937 rng(seed);
  Eigen::MatrixXd J(rows, kSize);
  for (int r = 0; r < rows; ++r) J.row(r) = random_vector<kSize>(rng).transpose();
  Eigen::VectorXd residual(rows);
  for (double& v : residual) v = random_vector<1>(rng)(0);
  return {J.transpose() * J, J.transpose() * residual};
}

TEST_CASE("Marginalisation leaves the batch solution of a linear problem as it is", "[vio]") {
  const unsigned seed = GENERATE(range(0U, 10U));
  CAPTURE(seed);
  const Quadratic q = random_quadratic(seed, 30);
  const SquareRootPrior prior = marginalize(q.H, q.g, kTaken);
  const Eigen::VectorXd batch = -q.H.ldlt().solve(q.g);
  const Eigen::MatrixXd H = prior.J.transpose() * prior.J;
  const Eigen::VectorXd solution = -H.ldlt().solve(prior.J.transpose() * prior.r);
  CHECK((solution - batch.tail(kSize - kTaken)).norm() < 1e-10);
  // So is the covariance of what is left.
  const Eigen::MatrixXd covariance =
      q.H.inverse().bottomRightCorner(kSize - kTaken, kSize - kTaken);
  CHECK((H.inverse() - covariance).norm() < 1e-9 * covariance.norm());
}

TEST_CASE("Later measurements and a prior give what all measurements give", "[vio]") {
  const Quadratic early = random_quadratic(1, 30);
  Quadratic late = random_quadratic(2, 30);
  late.H.topRows(kTaken).setZero();  // later ones no longer see what was taken out
  late.H.leftCols(kTaken).setZero();
  late.g.head(kTaken).setZero();
  const Eigen::VectorXd batch = -(early.H + late.H).ldlt().solve(early.g + late.g);
  const SquareRootPrior prior = marginalize(early.H, early.g, kTaken);
  constexpr int kLeft = kSize - kTaken;
  const Eigen::MatrixXd H = prior.J.transpose() * prior.J + late.H.bottomRightCorner(kLeft, kLeft);
  const Eigen::VectorXd g = prior.J.transpose() * prior.r + late.g.tail(kLeft);
  CHECK((-H.ldlt().solve(g) - batch.tail(kLeft)).norm() < 1e-10);
}

TEST_CASE("Directions without information stay without", "[vio]") {
  // Six measurements of twelve variables; scales differ by 1e8, as radians and accelerations do.
  Quadratic q = random_quadratic(5, 6);
  Eigen::VectorXd scale = Eigen::VectorXd::Ones(kSize);
  scale.tail(3).setConstant(1e4);
  q.H = scale.asDiagonal() * q.H * scale.asDiagonal();
  q.g = scale.asDiagonal() * q.g;
  const SquareRootPrior prior = marginalize(q.H, q.g, kTaken);
  CHECK(prior.J.rows() == 1);  // five of six are used up by what is taken out
  CHECK(prior.J.allFinite());
  CHECK(prior.r.allFinite());
}

TEST_CASE("Nothing taken out leaves the quadratic itself", "[vio]") {
  const Quadratic q = random_quadratic(3, 30);
  const SquareRootPrior prior = marginalize(q.H, q.g, 0);
  CHECK((prior.J.transpose() * prior.J - q.H).norm() < 1e-9 * q.H.norm());
  CHECK((prior.J.transpose() * prior.r - q.g).norm() < 1e-9 * q.g.norm());
}

}  // namespace
}  // namespace km
