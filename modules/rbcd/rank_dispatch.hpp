#pragma once

#include <Eigen/Core>

namespace km {

/// Calls `f.template operator()<kRank>()` with the rank as a compile-time constant for the ranks in
/// use, Eigen::Dynamic for others: small fixed sizes make the inner loops several times faster.
template <typename F>
void dispatch_rank(Eigen::Index rank, F&& f) {
  switch (rank) {
    case 3:
      return f.template operator()<3>();
    case 5:
      return f.template operator()<5>();
    default:
      return f.template operator()<Eigen::Dynamic>();
  }
}

/// Columns `first` to `first` + kCols - 1 of a matrix with kRank rows, with fixed sizes.
template <int kRank, int kCols>
auto lifted_block(const Eigen::MatrixXd& X, Eigen::Index first) {
  return Eigen::Map<const Eigen::Matrix<double, kRank, kCols>>(X.col(first).data(), X.rows(),
                                                               kCols);
}
template <int kRank, int kCols>
auto lifted_block(Eigen::MatrixXd& X, Eigen::Index first) {
  return Eigen::Map<Eigen::Matrix<double, kRank, kCols>>(X.col(first).data(), X.rows(), kCols);
}

}  // namespace km
