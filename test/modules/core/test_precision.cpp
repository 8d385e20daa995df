#include <catch2/catch.hpp>

#include <limits>

#include "modules/core/precision.hpp"

namespace km {
namespace {

TEST_CASE("Weights are equal after conversion to a covariance and back", "[precision]") {
  const Precision there{10000.0, 100.0};
  const Matrix6 covariance = covariance_of(there);
  CHECK(covariance(0, 0) == Approx(5e-5));  // [rad^2]
  CHECK(covariance(5, 5) == Approx(1e-2));  // [m^2]

  const Precision back = precision_of(covariance);
  CHECK(back.kappa == Approx(there.kappa));
  CHECK(back.tau == Approx(there.tau));
}

TEST_CASE("Weights are those of the blocks of the information matrix", "[precision]") {
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

TEST_CASE("A singular covariance has the weights of its own blocks", "[precision]") {
  Matrix6 covariance = Matrix6::Zero();
  covariance.diagonal() << 0.0, 0.0, 3e-4, 0.01, 0.02, 0.0;  // moves in a plane
  CHECK(precision_of(covariance).kappa == Approx(5000.0));
  CHECK(precision_of(covariance).tau == Approx(100.0));
}

TEST_CASE("Weights that are not positive and finite are refused", "[precision]") {
  const double infinite = std::numeric_limits<double>::infinity();
  CHECK_THROWS_AS(precision_of(Matrix6::Zero()), std::invalid_argument);
  CHECK_THROWS_AS(precision_of(Matrix6::Constant(std::nan(""))), std::invalid_argument);
  CHECK_THROWS_AS(covariance_of({0.0, 1.0}), std::invalid_argument);
  CHECK_THROWS_AS(covariance_of({1.0, infinite}), std::invalid_argument);
}

}  // namespace
}  // namespace km
