#include <catch2/catch.hpp>
#include <random>

#include "modules/rbcd/stiefel.hpp"

namespace km {
namespace {

constexpr double kRounding = 1e-12;

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

}  // namespace km
