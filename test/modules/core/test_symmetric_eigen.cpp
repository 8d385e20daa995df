#include <catch2/catch.hpp>

#include <Eigen/Core>
#include <random>

#include "modules/core/symmetric_eigen.hpp"

namespace km {

TEST_CASE("Eigenvalues ascend and belong to orthonormal eigenvectors", "[core]") {
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

}  // namespace km
