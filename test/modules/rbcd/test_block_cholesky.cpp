#include <catch2/catch.hpp>
#include <random>

#include "modules/rbcd/block_cholesky.hpp"

namespace km {
namespace {

// A random definite matrix; its entries are in blocks of 4 x 4, as for poses, or single.
Eigen::SparseMatrix<double> random_definite(int size, int block, std::mt19937& rng) {
  std::normal_distribution<double> normal;
  std::uniform_int_distribution<int> place(0, size / block - 1);
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(size, size);
  for (int n = 0; n < 2 * size / block; ++n) {
    Eigen::MatrixXd J = Eigen::MatrixXd::Zero(block, size);
    const int i = place(rng);
    const int j = place(rng);
    for (double& x : J.middleCols(i * block, block).reshaped()) x = normal(rng);
    for (double& x : J.middleCols(j * block, block).reshaped()) x = normal(rng);
    A += J.transpose() * J;
  }
  A.diagonal().array() += 0.1;
  return A.sparseView();
}

}  // namespace

TEST_CASE("The factor solves for rows of the right-hand side with any pattern", "[rbcd]") {
  const int block = GENERATE(1, 2, 4);
  const int poses = GENERATE(1, 2, 7, 40);
  const Eigen::Index rank = GENERATE(1, 3, 4, 5);
  const unsigned seed = GENERATE(1U, 2U, 3U);
  CAPTURE(block, poses, rank, seed);
  std::mt19937 rng(seed);
  std::normal_distribution<double> normal;
  const Eigen::SparseMatrix<double> A = random_definite(4 * poses, block, rng);
  Eigen::MatrixXd B(rank, 4 * poses);
  for (double& x : B.reshaped()) x = normal(rng);
  const Eigen::MatrixXd X = BlockCholesky(A).solve_rows(B);
  // The smallest eigenvalue is at least 0.1, the largest about 100.
  CHECK((X * A - B).norm() < 1e-10 * B.norm());
}

TEST_CASE("An indefinite matrix is not factorised", "[rbcd]") {
  Eigen::SparseMatrix<double> A(4, 4);
  A.setIdentity();
  A.coeffRef(2, 2) = -1.0;
  CHECK_THROWS_WITH(BlockCholesky(A), Catch::Contains("4 rows is not positive definite"));
}

}  // namespace km
