#pragma once

#include <Eigen/SparseCholesky>
#include <optional>

namespace km {

/// Sparse Cholesky factorisation of a symmetric positive definite matrix, for many right-hand sides
/// of a few rows each: rows of the right-hand side are kept side by side in memory, so that one
/// pass over the factor serves all of them.
class BlockCholesky {
 public:
  /// Factorises `A`, of which the lower triangle is read.
  /// Throws std::runtime_error if it is not positive definite.
  explicit BlockCholesky(const Eigen::SparseMatrix<double>& A);

  /// nullopt if `A` is not positive definite.
  [[nodiscard]] static std::optional<BlockCholesky> try_factorise(
      const Eigen::SparseMatrix<double>& A);

  /// B A^-1 for B of r rows: each row is one right-hand side.
  [[nodiscard]] Eigen::MatrixXd solve_rows(const Eigen::MatrixXd& B) const;

 private:
  explicit BlockCholesky(const Eigen::SimplicialLLT<Eigen::SparseMatrix<double>>& llt)
      : L_(llt.matrixL()), P_(llt.permutationP()) {}

  Eigen::SparseMatrix<double> L_;
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> P_;  // P A P^T = L L^T
};

}  // namespace km
