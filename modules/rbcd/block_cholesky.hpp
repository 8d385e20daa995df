#pragma once

#include <Eigen/SparseCholesky>
#include <vector>

namespace km {

/// Sparse Cholesky factorisation of a symmetric positive definite matrix, for many right-hand sides
/// of a few rows each. The rows of a right-hand side are adjacent in memory, so that one pass over
/// the factor serves all of them. Columns of the factor with equal rows below them, usually the
/// four of a pose, are stored and used together.
class BlockCholesky {
 public:
  /// Factorises `A`; only its lower triangle is read. Throws std::runtime_error if it is not
  /// positive definite.
  explicit BlockCholesky(const Eigen::SparseMatrix<double>& A);

  /// B A^-1 for B of r rows: each row is one right-hand side.
  [[nodiscard]] Eigen::MatrixXd solve_rows(const Eigen::MatrixXd& B) const;

 private:
  // Columns first to first + width - 1 of L. Each column has all rows from its diagonal to row
  // first + width - 1. The rows below are the same for all of these columns.
  struct Panel {
    int first = 0;
    int width = 0;
    std::size_t rows = 0;     // place in rows_ of the first row below
    std::size_t below = 0;    // number of rows below
    std::size_t entries = 0;  // place in values_: the triangle by columns, then the rest by rows
  };

  template <int kRank, int kCols>
  void forward(const Panel& panel, Eigen::MatrixXd& B) const;
  template <int kRank, int kCols>
  void backward(const Panel& panel, Eigen::MatrixXd& B) const;

  std::vector<Panel> panels_;
  std::vector<int> rows_;
  std::vector<double> values_;
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> P_;  // P A P^T = L L^T
};

}  // namespace km
