#include <Eigen/Core>

#include "modules/core/data/covariance.hpp"
#include "modules/core/geometry/covariance_root.hpp"
#include "modules/core/geometry/lie.hpp"
#include "modules/core/geometry/precision.hpp"
#include "modules/core/geometry/symmetric_eigen.hpp"
#include "test/support/random_pose.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

TEST_CASE("The composed covariance is that of sampled products") {
  std::mt19937 rng(5);
  const double sigma = 0.01;  // small, so that first-order propagation is exact to a few per cent
  const UncertainPose a{random_pose(rng, 2.0), random_covariance(rng, sigma)};
  const UncertainPose b{random_pose(rng, 2.0), random_covariance(rng, sigma)};
  const UncertainPose ab = compose(a, b);
  const Matrix6 La = a.Sigma.llt().matrixL();
  const Matrix6 Lb = b.Sigma.llt().matrixL();
  Matrix6 sampled = Matrix6::Zero();
  const int samples = 20000;
  for (int i = 0; i < samples; ++i) {
    const SE3 Ta = a.T * se3_exp(La * random_vector<6>(rng));
    const SE3 Tb = b.T * se3_exp(Lb * random_vector<6>(rng));
    const Vector6 xi = se3_log(ab.T.inverse() * Ta * Tb);
    sampled += xi * xi.transpose() / samples;
  }
  CHECK((sampled - ab.Sigma).norm() < 0.05 * ab.Sigma.norm());
}

TEST_CASE("The covariance between two poses of a chain is the one composed between them") {
  std::mt19937 rng(7);
  const UncertainPose a_b{random_pose(rng), random_covariance(rng, 0.1)};
  const UncertainPose b_c{random_pose(rng), random_covariance(rng, 0.2)};
  const UncertainPose found = between_on_chain(a_b, compose(a_b, b_c));
  CHECK((found.Sigma - b_c.Sigma).norm() < 1e-9);
  CHECK((found.T.matrix() - b_c.T.matrix()).norm() < 1e-12);
}

TEST_CASE("A wrong scale moves positions along their own direction") {
  std::mt19937 rng(11);
  const UncertainPose a{random_pose(rng), random_covariance(rng, 0.1)};
  const UncertainPose scaled = with_scale_error(a, 0.02);
  CHECK(scaled.T.isApprox(a.T, 0.0));
  const Eigen::Vector3d p = a.T.translation();
  Matrix6 expected = along_fixed_axes(a);  // position first
  expected.topLeftCorner<3, 3>() += 0.02 * 0.02 * p * p.transpose();
  CHECK((along_fixed_axes(scaled) - expected).norm() < 1e-12);
}

TEST_CASE("Matrices that are no covariance are refused") {
  CHECK(is_covariance(Matrix6::Identity()));
  CHECK(is_covariance(Matrix6::Zero()));
  Matrix6 bad = Matrix6::Identity();
  bad(0, 1) = 0.5;
  CHECK_FALSE(is_covariance(bad));  // not symmetric
  CHECK_FALSE(is_covariance(-Matrix6::Identity()));
  bad = Matrix6::Identity();
  bad(2, 2) = std::nan("");
  CHECK_FALSE(is_covariance(bad));
}

TEST_CASE("Covariances of states are usable within bounds and if invertible") {
  for (const double variance : {1e-16, 1.0, 1e6})
    CHECK(is_usable(variance * StateCovariance::Identity()));
  for (const double variance : {-1.0, 0.0, 1e-17, 1e7, std::nan(""), HUGE_VAL})
    CHECK_FALSE(is_usable(variance * StateCovariance::Identity()));
  StateCovariance covariance = StateCovariance::Identity();
  covariance(1, 9) = 1e-3;
  CHECK_FALSE(is_usable(covariance));  // not symmetric
  covariance(9, 1) = covariance(1, 9);
  CHECK(is_usable(covariance));
  covariance(9, 1) = covariance(1, 9) = 1.0;
  CHECK_FALSE(is_usable(covariance));  // fully correlated
}

TEST_CASE("A covariance with lever arms keeps its smallest variances") {
  // 10 km from the origin, 1 mrad makes 10 m; the step itself is certain to 1 mm and 0.1 mrad.
  const SE3 T_b_c = make_pose(Eigen::Matrix3d::Identity(), {10000.0, 2000.0, 0.0});
  UncertainPose T_a_b{.Sigma = 1e-6 * Matrix6::Identity()};
  UncertainPose step{T_b_c, 1e-6 * Matrix6::Identity()};
  step.Sigma.topLeftCorner<3, 3>() = 1e-8 * Eigen::Matrix3d::Identity();
  const Matrix6 Sigma = compose(T_a_b, step).Sigma;
  const auto received = covariance_of(covariance_root(Sigma));
  REQUIRE(received);
  CHECK(is_covariance(*received));
  // In every direction the variance is right to a thousandth: the eigenvalues of Sigma^-1 *
  // received are 1.
  const Matrix6 L = Sigma.llt().matrixL();
  const Matrix6 whitened = L.inverse() * *received * L.inverse().transpose();
  CHECK(symmetric_eigen(whitened).values.minCoeff() == Approx(1.0).margin(1e-3));
  CHECK(symmetric_eigen(whitened).values.maxCoeff() == Approx(1.0).margin(1e-3));
  // Rounded as it is, the matrix has a negative eigenvalue, or one that is wrong.
  const Matrix6 rounded = Sigma.cast<float>().cast<double>();
  const Matrix6 wrong = L.inverse() * rounded * L.inverse().transpose();
  CHECK(std::abs(symmetric_eigen(wrong).values.minCoeff() - 1.0) > 1e-3);
}

TEST_CASE("Directions without variance stay without") {
  CHECK(covariance_of(covariance_root(Matrix6::Zero())) == Matrix6(Matrix6::Zero()));
  Vector6 direction;
  direction << 0.0, 2.0, 0.0, 1.0, -1.0, 3.0;
  const Matrix6 Sigma = direction * direction.transpose();
  const auto received = covariance_of(covariance_root(Sigma));
  REQUIRE(received);
  CHECK(received->isApprox(Sigma, 1e-6));
}

TEST_CASE("A root that is not finite is refused") {
  CovarianceRoot root{};
  root[GENERATE(0U, 9U, 20U)] =
      GENERATE(std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity());
  CHECK_FALSE(covariance_of(root));
}

TEST_CASE("Weights are equal after conversion to a covariance and back") {
  const Precision there{10000.0, 100.0};
  const Matrix6 covariance = covariance_of(there);
  CHECK(covariance(0, 0) == Approx(5e-5));  // [rad^2]
  CHECK(covariance(5, 5) == Approx(1e-2));  // [m^2]

  const Precision back = precision_of(covariance);
  CHECK(back.kappa == Approx(there.kappa));
  CHECK(back.tau == Approx(there.tau));
}

TEST_CASE("Weights are those of the blocks of the information matrix") {
  // Each axis of rotation moves one axis of translation by a lever arm of 40 m.
  const double sigma_rad = 0.01, sigma_m = 0.1, arm_m = 40.0;
  const double variance_m2 = sigma_m * sigma_m + arm_m * arm_m * sigma_rad * sigma_rad;
  Matrix6 covariance = Matrix6::Zero();
  covariance.topLeftCorner<3, 3>().diagonal().setConstant(sigma_rad * sigma_rad);
  covariance.bottomRightCorner<3, 3>().diagonal().setConstant(variance_m2);
  covariance.topRightCorner<3, 3>().diagonal().setConstant(arm_m * sigma_rad * sigma_rad);
  const Precision upper = precision_of(covariance);  // the lower triangle does not count
  covariance.bottomLeftCorner<3, 3>() = covariance.topRightCorner<3, 3>();
  const Precision weights = precision_of(covariance);
  CHECK(weights.kappa == Approx(0.5 * (1e4 + 40.0 * 40.0 * 100.0)));
  CHECK(weights.tau == Approx(100.0));
  CHECK(upper.kappa == weights.kappa);
  CHECK(upper.tau == weights.tau);
}

TEST_CASE("A singular covariance has the weights of its own blocks") {
  Matrix6 covariance = Matrix6::Zero();
  covariance.diagonal() << 0.0, 0.0, 3e-4, 0.01, 0.02, 0.0;  // moves in a plane
  CHECK(precision_of(covariance).kappa == Approx(5000.0));
  CHECK(precision_of(covariance).tau == Approx(100.0));
}

TEST_CASE("Weights that are not positive and finite are refused") {
  const double infinite = std::numeric_limits<double>::infinity();
  CHECK_THROWS_AS(precision_of(Matrix6::Zero()), std::invalid_argument);
  CHECK_THROWS_AS(precision_of(Matrix6::Constant(std::nan(""))), std::invalid_argument);
  CHECK_THROWS_AS(covariance_of({0.0, 1.0}), std::invalid_argument);
  CHECK_THROWS_AS(covariance_of({1.0, infinite}), std::invalid_argument);
}

TEST_CASE("Eigenvalues ascend and belong to orthonormal eigenvectors") {
  Eigen::MatrixXd A(2, 2);
  A << 2.0, 1.0, 1.0, 2.0;
  const SymmetricEigen known = symmetric_eigen(A);
  CHECK(known.values(0) == Approx(1.0));
  CHECK(known.values(1) == Approx(3.0));

  const Eigen::Index n = GENERATE(1, 6, 70);
  CAPTURE(n);
  std::mt19937 rng(1);
  std::normal_distribution<double> normal;
  Eigen::MatrixXd B(n, n);
  for (double& b : B.reshaped()) b = normal(rng);
  const Eigen::MatrixXd S = B + B.transpose();
  const SymmetricEigen eigen = symmetric_eigen(S);
  for (Eigen::Index k = 1; k < n; ++k) CHECK(eigen.values(k - 1) <= eigen.values(k));
  const double rounding = 1e-13 * static_cast<double>(n);  // relative to the largest value
  CHECK((eigen.vectors.transpose() * eigen.vectors - Eigen::MatrixXd::Identity(n, n)).norm() <
        rounding);
  CHECK((eigen.vectors * eigen.values.asDiagonal() * eigen.vectors.transpose() - S).norm() <
        rounding * eigen.values.cwiseAbs().maxCoeff());
}

}  // namespace
}  // namespace km
