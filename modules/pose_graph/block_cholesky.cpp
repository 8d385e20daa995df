#include "modules/pose_graph/block_cholesky.hpp"

#include <stdexcept>

#include "modules/pose_graph/rank_dispatch.hpp"

namespace km {
namespace {

using Factor = Eigen::SparseMatrix<double>;

// B L^-T in place, with the diagonal entry first in every column of L.
template <int kRank>
void substitute_forward(const Factor& L, Eigen::MatrixXd& B) {
  for (Eigen::Index c = 0; c < L.cols(); ++c) {
    Factor::InnerIterator entry(L, c);
    auto b_c = lifted_block<kRank, 1>(B, c);
    b_c /= entry.value();
    for (++entry; entry; ++entry)
      lifted_block<kRank, 1>(B, entry.row()).noalias() -= entry.value() * b_c;
  }
}

// B L^-1 in place.
template <int kRank>
void substitute_backward(const Factor& L, Eigen::MatrixXd& B) {
  for (Eigen::Index c = L.cols(); c-- > 0;) {
    Factor::InnerIterator entry(L, c);
    const double diagonal = entry.value();
    auto b_c = lifted_block<kRank, 1>(B, c);
    for (++entry; entry; ++entry)
      b_c.noalias() -= entry.value() * lifted_block<kRank, 1>(B, entry.row());
    b_c /= diagonal;
  }
}

}  // namespace

BlockCholesky::BlockCholesky(const Eigen::SparseMatrix<double>& A) {
  auto factor = try_factorise(A);
  if (!factor)
    throw std::runtime_error("BlockCholesky: matrix of " + std::to_string(A.rows()) +
                             " rows is not positive definite");
  *this = std::move(*factor);
}

std::optional<BlockCholesky> BlockCholesky::try_factorise(const Eigen::SparseMatrix<double>& A) {
  const Eigen::SimplicialLLT<Eigen::SparseMatrix<double>> llt(A);
  return llt.info() == Eigen::Success ? std::optional(BlockCholesky(llt)) : std::nullopt;
}

Eigen::MatrixXd BlockCholesky::solve_rows(const Eigen::MatrixXd& B) const {
  Eigen::MatrixXd permuted = B * P_.transpose();
  dispatch_rank(B.rows(), [&]<int kRank>() {
    substitute_forward<kRank>(L_, permuted);
    substitute_backward<kRank>(L_, permuted);
  });
  return permuted * P_;
}

}  // namespace km
