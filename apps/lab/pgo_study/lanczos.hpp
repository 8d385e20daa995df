#pragma once

#include <Eigen/Core>
#include <random>

#include "modules/core/symmetric_eigen.hpp"

namespace km {

struct [[nodiscard]] LanczosResult {
  double value = 0.0;
  Eigen::VectorXd vector = {};  ///< Unit eigenvector.
  int products = 0;             ///< Applications of the operator.
  bool converged = false;
};

/// Computes the largest eigenvalue and its eigenvector of a symmetric operator `apply` of size n.
/// The method is Lanczos' with full reorthogonalisation (Golub and Van Loan, "Matrix
/// Computations"). Once converged, the residual is at most `tolerance` times the value. The start
/// is random.
template <typename Operator>
LanczosResult largest_eigenpair(const Operator& apply, Eigen::Index n, int max_products,
                                double tolerance, unsigned seed) {
  const Eigen::Index m = std::min<Eigen::Index>(n, max_products);
  Eigen::MatrixXd V(n, m + 1);
  Eigen::VectorXd alpha(m);
  Eigen::VectorXd beta(m);
  std::mt19937 rng(seed);
  std::normal_distribution<double> normal;
  for (double& v : V.col(0)) v = normal(rng);
  V.col(0).normalize();
  LanczosResult result;
  for (Eigen::Index k = 0; k < m; ++k) {
    Eigen::VectorXd w = apply(V.col(k));
    alpha(k) = V.col(k).dot(w);
    for (int pass = 0; pass < 2; ++pass)
      w -= V.leftCols(k + 1) * (V.leftCols(k + 1).transpose() * w).eval();
    beta(k) = w.norm();
    const SymmetricEigen ritz = tridiagonal_eigen(alpha.head(k + 1), beta.head(k));
    result.value = ritz.values(k);
    result.products = static_cast<int>(k) + 1;
    const double residual = beta(k) * std::abs(ritz.vectors(k, k));
    result.converged = residual <= tolerance * std::abs(result.value);
    if (result.converged || k + 1 == m || !(beta(k) > 0.0)) {
      result.vector = (V.leftCols(k + 1) * ritz.vectors.col(k)).normalized();
      break;
    }
    V.col(k + 1) = w / beta(k);
  }
  return result;
}

}  // namespace km
