#include <catch2/catch.hpp>

#include <cmath>

#include "modules/core/covariance.hpp"
#include "modules/core/lie.hpp"
#include "test/support/random_pose.hpp"

namespace km {
namespace {

TEST_CASE("The composed covariance is that of sampled products", "[core]") {
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

TEST_CASE("The covariance between two poses of a chain is the one composed between them",
          "[core]") {
  std::mt19937 rng(7);
  const UncertainPose a_b{random_pose(rng), random_covariance(rng, 0.1)};
  const UncertainPose b_c{random_pose(rng), random_covariance(rng, 0.2)};
  const UncertainPose found = between_on_chain(a_b, compose(a_b, b_c));
  CHECK((found.Sigma - b_c.Sigma).norm() < 1e-9);
  CHECK((found.T.matrix() - b_c.T.matrix()).norm() < 1e-12);
}

TEST_CASE("A wrong scale moves positions along their own direction", "[core]") {
  std::mt19937 rng(11);
  const UncertainPose a{random_pose(rng), random_covariance(rng, 0.1)};
  const UncertainPose scaled = with_scale_error(a, 0.02);
  CHECK(scaled.T.isApprox(a.T, 0.0));
  const Eigen::Vector3d p = a.T.translation();
  Matrix6 expected = along_fixed_axes(a);  // position first
  expected.topLeftCorner<3, 3>() += 0.02 * 0.02 * p * p.transpose();
  CHECK((along_fixed_axes(scaled) - expected).norm() < 1e-12);
}

TEST_CASE("Matrices that are no covariance are refused", "[core]") {
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

TEST_CASE("Covariances of states are usable within bounds and if invertible", "[core]") {
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

}  // namespace
}  // namespace km
