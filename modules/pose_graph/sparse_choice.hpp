#pragma once

#include <vector>

#include "modules/pose_graph/block_matrix.hpp"

namespace km {

/// Which nodes of a graph to keep so that the Schur complement has few couplings: those in `keep`,
/// none of those in `eliminate` (empty: none is), and of the others all whose elimination would add
/// more couplings than it removes. Greedy: the node that adds fewest, net, is eliminated first.
/// O(nodes x couplings of the result / 64).
[[nodiscard]] std::vector<bool> keep_sparse(std::vector<bool> keep,
                                            const std::vector<NodePair>& pairs,
                                            const std::vector<bool>& eliminate = {});

}  // namespace km
