#pragma once

#include <Eigen/Core>

namespace km {

/// A = vectors * diag(values) * vectors^T.
struct [[nodiscard]] SymmetricEigen {
  Eigen::VectorXd values;   ///< ascending
  Eigen::MatrixXd vectors;  ///< orthonormal columns
};

/// Eigenvalues and eigenvectors of the symmetric matrix A, of which the lower triangle is read.
/// Eigen's solver takes seconds to compile, so that it is compiled here for all sizes. A fixed size
/// up to 3x3 is faster with Eigen's own.
SymmetricEigen symmetric_eigen(const Eigen::Ref<const Eigen::MatrixXd>& A);

}  // namespace km
