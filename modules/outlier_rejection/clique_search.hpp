#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "modules/outlier_rejection/bit_graph.hpp"

namespace km {

/// What a clique search has to find and how hard it may try.
struct CliqueGoal {
  std::size_t more_than = 0;    ///< Smaller cliques, and those of this size, are of no interest.
  std::size_t enough = 0;       ///< Stop at the first clique of this size.
  std::uint64_t max_nodes = 0;  ///< Of the search tree; a count, so that the result is repeatable.
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
/// Where a greedy colouring needs no more colours than `more_than` there is none. Else vertices
/// with too few neighbours are peeled off (k-core; Pattabiraman et al., "Fast Algorithms for the
/// Maximum Clique Problem on Massive Graphs", Internet Mathematics 2015). What is left is searched
/// depth-first on bit sets in degeneracy order, bounded by greedy colouring with recolouring (San
/// Segundo et al., "An improved bit parallel exact maximum clique algorithm", Optimization Letters
/// 2013); vertices adjacent to all other candidates are taken without branching. Exact unless the
/// limit ends it; deterministic. Exponential at worst.
CliqueSearch find_clique(const BitGraph& graph, std::span<const std::size_t> candidates,
                         const CliqueGoal& goal);

}  // namespace km
