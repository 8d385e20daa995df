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

/// The clique that this finds from v, ascending, v included; empty unless it has more than
/// `more_than` vertices.
[[nodiscard]] std::vector<std::size_t> greedy_clique_with(const BitGraph& graph, std::size_t v,
                                                          std::size_t more_than);

/// The largest found from any vertex; of equally large ones that from the lowest.
[[nodiscard]] std::vector<std::size_t> greedy_clique(const BitGraph& graph);

}  // namespace km
