#include "modules/core/geometry/symmetric_eigen.hpp"

#include <Eigen/Eigenvalues>

namespace km {

SymmetricEigen symmetric_eigen(const Eigen::Ref<const Eigen::MatrixXd>& A) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(A);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

}  // namespace km
