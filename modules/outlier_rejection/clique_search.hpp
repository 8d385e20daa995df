#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "modules/outlier_rejection/bit_graph.hpp"

namespace km {

/// Goal and limit of a clique search.
struct CliqueGoal {
  std::size_t more_than = 0;    ///< Smaller cliques, and those of this size, are of no interest.
  std::size_t enough = 0;       ///< Stop at the first clique of this size.
  std::uint64_t max_nodes = 0;  ///< Maximum size of the search tree; a count, so that the result is
                                ///< repeatable.
};

struct [[nodiscard]] CliqueSearch {
  std::vector<std::size_t> clique;  ///< Ascending; empty if none larger than asked for was found.
  bool proven = true;               ///< False if the limit ended the search before its goal.
  std::size_t bound = 0;            ///< No clique of the candidates is larger, unless the search
                                    ///< stopped at one that was large enough.
  std::uint64_t nodes = 0;          ///< Nodes of the search tree visited.
};

/// Searches the largest clique of `graph` among the vertices `candidates`.
///
/// If a greedy colouring needs no more colours than `more_than`, no such clique exists. Otherwise
/// vertices with too few neighbours are removed (k-core; Pattabiraman et al., "Fast Algorithms for
/// the Maximum Clique Problem on Massive Graphs", Internet Mathematics 2015). The remaining
/// vertices are searched depth-first on bit sets in degeneracy order. Greedy colouring with
/// recolouring bounds the search (San Segundo et al., "An improved bit parallel exact maximum
/// clique algorithm", Optim. Lett. 2013). Vertices adjacent to all other candidates are taken
/// without branching. Exact unless the limit ends it; deterministic. Exponential at worst.
CliqueSearch find_clique(const BitGraph& graph, std::span<const std::size_t> candidates,
                         const CliqueGoal& goal);

// The heuristic of Pattabiraman et al., "Fast Algorithms for the Maximum Clique Problem on Massive
// Graphs with Applications to Overlapping Community Detection", Internet Mathematics 2015:
// repeatedly take the vertex of greatest degree among those adjacent to all taken so far, without
// backtracking. Vertices whose degree is too small for a clique larger than the known one are
// excluded. Equal degrees: the vertex with the lowest number. No guarantee; O(vertices^2 / 64) per
// start.

/// The clique that this makes of `clique`, which it contains; ascending. Empty unless it has more
/// than `more_than` vertices. Precondition: `clique` is one and not empty.
[[nodiscard]] std::vector<std::size_t> greedy_extension(const BitGraph& graph,
                                                        std::vector<std::size_t> clique,
                                                        std::size_t more_than);

/// The largest that it makes of any single vertex; of equally large ones that from the lowest.
[[nodiscard]] std::vector<std::size_t> greedy_clique(const BitGraph& graph);

}  // namespace km
