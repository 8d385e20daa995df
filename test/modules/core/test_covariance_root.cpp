#include <array>
#include <catch2/catch.hpp>
#include <limits>
#include <random>

#include "modules/core/covariance.hpp"
#include "modules/core/covariance_root.hpp"
#include "modules/core/lie.hpp"
#include "modules/core/symmetric_eigen.hpp"
#include "test/support/random_pose.hpp"

namespace km {
namespace {

TEST_CASE("A covariance with lever arms keeps its smallest variances", "[covariance_root]") {
  // 10 km from the origin, 1 mrad makes 10 m; the step itself is certain to 1 mm and 0.1 mrad.
  const SE3 T_b_c = make_pose(Eigen::Matrix3d::Identity(), {10000.0, 2000.0, 0.0});
  UncertainPose T_a_b;
  T_a_b.Sigma = 1e-6 * Matrix6::Identity();
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

TEST_CASE("Directions without variance stay without", "[covariance_root]") {
  CHECK(covariance_of(covariance_root(Matrix6::Zero())) == Matrix6(Matrix6::Zero()));
  Vector6 direction;
  direction << 0.0, 2.0, 0.0, 1.0, -1.0, 3.0;
  const Matrix6 Sigma = direction * direction.transpose();
  const auto received = covariance_of(covariance_root(Sigma));
  REQUIRE(received);
  CHECK(received->isApprox(Sigma, 1e-6));
}

TEST_CASE("A root that is not finite is refused", "[covariance_root]") {
  CovarianceRoot root{};
  root[GENERATE(0U, 9U, 20U)] =
      GENERATE(std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity());
  CHECK_FALSE(covariance_of(root));
}

}  // namespace
}  // namespace km
