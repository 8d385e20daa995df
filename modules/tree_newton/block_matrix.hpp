#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <concepts>
#include <cstddef>
#include <vector>

namespace km {

/// A number of a node, pair or pose as the index of a container.
[[nodiscard]] constexpr std::size_t at(std::integral auto number) {
  return static_cast<std::size_t>(number);
}

/// Two coupled nodes {i, j} of a graph. Their block A(i, j) of a matrix has the rows of i and the
/// columns of j.
using NodePair = std::array<int, 2>;

[[nodiscard]] inline NodePair ordered(int i, int j) {
  return {std::min(i, j), std::max(i, j)};
}

/// Place of the ordered pair of i and j in the ascending list `pairs`, which has it.
[[nodiscard]] inline int index_of(const std::vector<NodePair>& pairs, int i, int j) {
  return static_cast<int>(std::ranges::lower_bound(pairs, ordered(i, j)) - pairs.begin());
}

/// A symmetric matrix of square blocks, one block row per node of a graph. `diagonal` has the
/// diagonal blocks side by side, B x (B nodes). `coupling` has the blocks A(i, j) side by side, one
/// for each pair {i, j} of a list, B x (B pairs). The list is stored elsewhere (EliminationPlan,
/// TreeSystem), because several matrices share it.
struct BlockMatrix {
  Eigen::MatrixXd diagonal = {};
  Eigen::MatrixXd coupling = {};

  [[nodiscard]] static BlockMatrix zero(Eigen::Index block, std::size_t nodes, std::size_t pairs) {
    return {Eigen::MatrixXd::Zero(block, block * static_cast<Eigen::Index>(nodes)),
            Eigen::MatrixXd::Zero(block, block * static_cast<Eigen::Index>(pairs))};
  }

  [[nodiscard]] Eigen::Index block() const { return diagonal.rows(); }
  [[nodiscard]] auto at(int node) { return diagonal.middleCols(block() * node, block()); }
  [[nodiscard]] auto at(int node) const { return diagonal.middleCols(block() * node, block()); }
  [[nodiscard]] auto between(int pair) { return coupling.middleCols(block() * pair, block()); }
  [[nodiscard]] auto between(int pair) const {
    return coupling.middleCols(block() * pair, block());
  }
  /// Adds `values`, or their transpose, to the coupling of a pair.
  void add(int pair, bool transposed, const auto& values) {
    if (transposed)
      between(pair) += values.transpose();
    else
      between(pair) += values;
  }
};

}  // namespace km
