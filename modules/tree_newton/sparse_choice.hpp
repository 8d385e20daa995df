#pragma once

#include <vector>

#include "modules/tree_newton/block_matrix.hpp"

namespace km {

/// The nodes of a graph to keep so that the Schur complement has few couplings. All nodes in `keep`
/// are kept, and all nodes in `eliminate` (empty: none) are eliminated. Other nodes are kept if
/// their elimination would add more couplings than it removes. Greedy: the node with the smallest
/// net increase of couplings is eliminated first. Time O(nodes x couplings of the result / 64),
/// with the nodes that are not in `eliminate`; memory O(pairs), and the square of these nodes in
/// bits.
[[nodiscard]] std::vector<bool> keep_sparse(std::vector<bool> keep,
                                            const std::vector<NodePair>& pairs,
                                            std::vector<bool> eliminate = {});

}  // namespace km
