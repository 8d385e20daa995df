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

TEST_CASE("Weights that are not positive and finite are refused", "[precision]") {
  const double infinite = std::numeric_limits<double>::infinity();
  CHECK_THROWS_AS(precision_of(Matrix6::Zero()), std::invalid_argument);
  CHECK_THROWS_AS(precision_of(Matrix6::Constant(std::nan(""))), std::invalid_argument);
  CHECK_THROWS_AS(covariance_of({0.0, 1.0}), std::invalid_argument);
  CHECK_THROWS_AS(covariance_of({1.0, infinite}), std::invalid_argument);
}

}  // namespace
}  // namespace km
