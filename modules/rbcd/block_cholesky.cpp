#include "modules/rbcd/block_cholesky.hpp"

#include <stdexcept>

#include "modules/rbcd/rank_dispatch.hpp"

namespace km {
namespace {

using Factor = Eigen::SparseMatrix<double>;

constexpr int kWidth = 4;  // columns of a panel; other panels have 1

// True if columns `first` to `first` + kWidth - 1 have equal rows from the last of these columns
// on. The rows below the diagonal of a column are a subset of the rows of its parent in the
// elimination tree, so it suffices to count them.
bool is_panel(const Factor& L, int first) {
  if (first + kWidth > L.cols()) return false;
  const int* begin = L.outerIndexPtr() + first;
  for (int k = 0; k + 1 < kWidth; ++k)
    if (begin[k + 1] - begin[k] != begin[k + 2] - begin[k + 1] + 1 ||
        L.innerIndexPtr()[begin[k] + 1] != first + k + 1)
      return false;
  return true;
}

}  // namespace

BlockCholesky::BlockCholesky(const Eigen::SparseMatrix<double>& A) {
  const Eigen::SimplicialLLT<Eigen::SparseMatrix<double>> llt(A);
  if (llt.info() != Eigen::Success)
    throw std::runtime_error("BlockCholesky: matrix of " + std::to_string(A.rows()) +
                             " rows is not positive definite");
  P_ = llt.permutationP();
  const Factor L = llt.matrixL();
  const int* begin = L.outerIndexPtr();
  values_.reserve(static_cast<std::size_t>(L.nonZeros()));
  for (int first = 0; first < L.cols();) {
    const int width = is_panel(L, first) ? kWidth : 1;
    const int below = begin[first + width] - begin[first + width - 1] - 1;
    panels_.push_back(
        {first, width, rows_.size(), static_cast<std::size_t>(below), values_.size()});
    const auto value = [&](int column, int place) { return L.valuePtr()[begin[column] + place]; };
    for (int k = 0; k < width; ++k)
      for (int place = 0; place < width - k; ++place) values_.push_back(value(first + k, place));
    for (int row = 0; row < below; ++row) {
      rows_.push_back(L.innerIndexPtr()[begin[first] + width + row]);
      for (int k = 0; k < width; ++k) values_.push_back(value(first + k, width - k + row));
    }
    first += width;
  }
}

// One step of the substitution B <- B L^-T. Divides the columns `panel` of B by their triangle of
// L, and subtracts them from the later columns.
template <int kRank, int kCols>
void BlockCholesky::forward(const Panel& panel, Eigen::MatrixXd& B) const {
  const double* entry = values_.data() + panel.entries;
  auto X = lifted_block<kRank, kCols>(B, panel.first);
  for (int k = 0; k < kCols; ++k) {
    X.col(k) /= *entry++;
    for (int later = k + 1; later < kCols; ++later) X.col(later) -= *entry++ * X.col(k);
  }
  const Eigen::Matrix<double, kRank, kCols> solved = X;
  for (std::size_t n = 0; n < panel.below; ++n, entry += kCols)
    lifted_block<kRank, 1>(B, rows_[panel.rows + n]).noalias() -=
        solved * Eigen::Map<const Eigen::Matrix<double, kCols, 1>>(entry);
}

// One step of the substitution B <- B L^-1. Subtracts the later columns of B from the columns
// `panel`, and divides these by their triangle of L.
template <int kRank, int kCols>
void BlockCholesky::backward(const Panel& panel, Eigen::MatrixXd& B) const {
  constexpr int kTriangle = kCols * (kCols + 1) / 2;
  const double* triangle = values_.data() + panel.entries;
  const double* entry = triangle + kTriangle;
  auto X = lifted_block<kRank, kCols>(B, panel.first);
  Eigen::Matrix<double, kRank, kCols> sum = X;
  for (std::size_t n = 0; n < panel.below; ++n, entry += kCols)
    sum.noalias() -= lifted_block<kRank, 1>(B, rows_[panel.rows + n]) *
                     Eigen::Map<const Eigen::Matrix<double, 1, kCols>>(entry);
  const double* diagonal = triangle + kTriangle;
  for (int k = kCols; k-- > 0;) {
    diagonal -= kCols - k;
    for (int later = k + 1; later < kCols; ++later)
      sum.col(k) -= diagonal[later - k] * sum.col(later);
    sum.col(k) /= *diagonal;
  }
  X = sum;
}

Eigen::MatrixXd BlockCholesky::solve_rows(const Eigen::MatrixXd& B) const {
  Eigen::MatrixXd permuted = B * P_.transpose();
  dispatch_rank(B.rows(), [&]<int kRank>() {
    for (const Panel& panel : panels_)
      panel.width == 1 ? forward<kRank, 1>(panel, permuted)
                       : forward<kRank, kWidth>(panel, permuted);
    for (auto panel = panels_.rbegin(); panel != panels_.rend(); ++panel)
      panel->width == 1 ? backward<kRank, 1>(*panel, permuted)
                        : backward<kRank, kWidth>(*panel, permuted);
  });
  return permuted * P_;
}

}  // namespace km
