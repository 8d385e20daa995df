#include <catch2/catch.hpp>

#include <Eigen/Core>
#include <cmath>
#include <numbers>
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

TEST_CASE("A tridiagonal matrix has the eigenvalues of the full one", "[core]") {
  // With 2 on the diagonal and -1 beside it, they are 2 - 2 cos(k pi / (n + 1)) for k = 1 to n.
  const Eigen::Index n = GENERATE(1, 2, 30);
  CAPTURE(n);
  const SymmetricEigen eigen =
      tridiagonal_eigen(Eigen::VectorXd::Constant(n, 2.0), Eigen::VectorXd::Constant(n - 1, -1.0));
  Eigen::MatrixXd A = 2.0 * Eigen::MatrixXd::Identity(n, n);
  A.diagonal(1).setConstant(-1.0);
  A.diagonal(-1).setConstant(-1.0);
  for (Eigen::Index k = 0; k < n; ++k)
    CHECK(eigen.values(k) ==
          Approx(2.0 - 2.0 * std::cos(static_cast<double>(k + 1) * std::numbers::pi /
                                      static_cast<double>(n + 1))));
  CHECK((A * eigen.vectors - eigen.vectors * eigen.values.asDiagonal()).norm() < 1e-12);
}

TEST_CASE("Only the lower triangle of a symmetric matrix is read", "[core]") {
  Eigen::MatrixXd A(2, 2);
  A << 2.0, 77.0, 1.0, 2.0;
  CHECK(symmetric_eigen(A).values(0) == Approx(1.0));
}

}  // namespace km
