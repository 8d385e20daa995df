#include "modules/outlier_rejection/max_clique.hpp"

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <string>

#include "modules/outlier_rejection/clique_search.hpp"

namespace km {
namespace {

void check_neighbours(std::span<const std::size_t> neighbours, std::size_t size) {
  BitSet seen(size);
  for (const std::size_t u : neighbours) {
    if (u >= size || seen.contains(u))
      throw std::invalid_argument("MaxClique::add: neighbour " + std::to_string(u) +
                                  (u >= size ? " does not exist" : " is given twice"));
    seen.insert(u);
  }
}

// A wrong set would weld wrong places together: one look at every pair costs little.
void verify(const BitGraph& graph, std::span<const std::size_t> clique) {
  for (std::size_t i = 0; i < clique.size(); ++i)
    for (std::size_t k = 0; k < i; ++k)
      if (!graph.adjacent(clique[i], clique[k]))
        throw std::logic_error("MaxClique: the search returned a set that is not a clique");
}

}  // namespace

bool MaxClique::add(std::span<const std::size_t> neighbours) {
  check_neighbours(neighbours, size());
  const std::size_t v = graph_.add_vertex();
  for (const std::size_t u : neighbours) graph_.connect(u, v);
  if (neighbours.size() < clique_.size()) return false;

  std::vector<std::size_t> larger = larger_clique_with(v, neighbours);
  if (larger.empty()) return false;
  verify(graph_, larger);
  clique_ = std::move(larger);
  return true;
}

std::vector<std::size_t> MaxClique::larger_clique_with(std::size_t v,
                                                       std::span<const std::size_t> neighbours) {
  const auto is_neighbour = [&](std::size_t u) { return graph_.adjacent(u, v); };
  if (std::all_of(clique_.begin(), clique_.end(), is_neighbour)) {
    std::vector<std::size_t> extended = clique_;
    extended.push_back(v);
    return extended;
  }
  const std::size_t no_limit = std::numeric_limits<std::size_t>::max();
  CliqueSearch search = find_clique(graph_, neighbours,
                                    {.more_than = clique_.size() - 1,
                                     .enough = proven_ ? clique_.size() : no_limit,
                                     .max_nodes = max_search_nodes_});
  search_nodes_ += search.nodes;
  proven_ = proven_ && search.proven;
  if (!search.clique.empty()) search.clique.push_back(v);
  return std::move(search.clique);
}

}  // namespace km
