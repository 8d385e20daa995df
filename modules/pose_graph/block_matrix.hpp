#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <vector>

namespace km {

/// Two nodes of a graph whose unknowns are coupled, the first one above the second.
using NodePair = std::array<int, 2>;

/// A symmetric matrix of square blocks, one block row per node of a graph. The diagonal blocks are
/// side by side, B x (B nodes). So are the blocks A(i, j), one for each of a list of pairs {i, j},
/// B x (B pairs). The list is stored elsewhere, because many matrices share it.
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
};

}  // namespace km
