#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "modules/outlier_rejection/bit_graph.hpp"

namespace km {

/// Goal and limit of a clique search.
struct CliqueGoal {
  std::size_t more_than = 0;    ///< Size that a clique must exceed.
  std::size_t enough = 0;       ///< Size of a clique that ends the search.
  std::uint64_t max_nodes = 0;  ///< Maximum number of nodes of the search tree.
};

struct [[nodiscard]] CliqueSearch {
  std::vector<std::size_t>
      clique;               ///< Ascending; empty if no clique larger than more_than is found.
  bool proven = true;       ///< False if the limit ended the search before its goal.
  std::size_t bound = 0;    ///< Upper bound on the size of a clique of the candidates,
                            ///< except after a search that ended at `enough`.
  std::uint64_t nodes = 0;  ///< Number of visited nodes of the search tree.
};

/// Searches the largest clique of `graph` among the vertices `candidates`.
///
/// If a greedy colouring needs no more colours than `more_than`, no such clique exists. Otherwise
/// vertices with too few neighbours are removed (k-core; Pattabiraman et al., "Fast Algorithms for
/// the Maximum Clique Problem on Massive Graphs", Internet Mathematics 2015). The remaining
/// vertices are searched depth-first on bit sets in degeneracy order. Greedy colouring with
/// recolouring bounds the search (San Segundo et al., "An improved bit parallel exact maximum
/// clique algorithm", Optim. Lett. 2013). Vertices adjacent to all other candidates are taken
/// without branching. Exact unless the limit ends the search; deterministic. Exponential at worst.
CliqueSearch find_clique(const BitGraph& graph, std::span<const std::size_t> candidates,
                         const CliqueGoal& goal);

/// Extends `clique` by the heuristic of Pattabiraman et al. (Internet Mathematics 2015); ascending.
/// Empty unless the result has more than `more_than` vertices. The heuristic repeatedly adds the
/// vertex of greatest degree among those adjacent to the whole clique, without backtracking; of
/// equal degrees, the vertex with the lowest number. Vertices whose degree is too small for a
/// clique of more than `more_than` vertices are excluded. The result need not be a maximum.
/// O(vertices^2 / 64). Precondition: `clique` is a clique with at least one vertex.
[[nodiscard]] std::vector<std::size_t> greedy_extension(const BitGraph& graph,
                                                        std::vector<std::size_t> clique,
                                                        std::size_t more_than);

}  // namespace km
