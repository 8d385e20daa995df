#pragma once

#include <cstddef>
#include <vector>

#include "modules/outlier_rejection/bit_graph.hpp"

namespace km {

// The heuristic of Pattabiraman et al., "Fast Algorithms for the Maximum Clique Problem on Massive
// Graphs with Applications to Overlapping Community Detection", Internet Mathematics 2015: of the
// vertices adjacent to all taken so far, take the one of the greatest degree, and never go back.
// Vertices whose degree is too small for a clique larger than the known one are left out. Equal
// degrees: the vertex with the lowest number. No guarantee; O(vertices^2 / 64) per start.

/// The clique that this makes of `clique`, which it contains; ascending. Empty unless it has more
/// than `more_than` vertices. Precondition: `clique` is one and not empty.
[[nodiscard]] std::vector<std::size_t> greedy_extension(const BitGraph& graph,
                                                        std::vector<std::size_t> clique,
                                                        std::size_t more_than);

/// The largest that it makes of any single vertex; of equally large ones that from the lowest.
[[nodiscard]] std::vector<std::size_t> greedy_clique(const BitGraph& graph);

}  // namespace km
