#include "modules/outlier_rejection/max_clique.hpp"

#include <algorithm>
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

// Throws std::logic_error if `clique` is no clique, because a wrong set would join wrong places.
void verify(const BitGraph& graph, std::span<const std::size_t> clique) {
  BitSet members(graph.capacity());
  for (const std::size_t v : clique) members.insert(v);
  for (const std::size_t v : clique)
    if (!members.all_but_one_in(v, graph.neighbours(v)))
      throw std::logic_error("MaxClique: the search returned a set that is not a clique");
}

}  // namespace

bool MaxClique::add(std::span<const std::size_t> neighbours) {
  check_neighbours(neighbours, size());
  const std::size_t v = graph_.add_vertex();
  for (const std::size_t u : neighbours) graph_.connect(u, v);
  const std::size_t before = clique_.size();
  const std::size_t most = std::min(bound_, neighbours.size()) + 1;  // bound of any clique with v
  if (neighbours.size() >= before) search(v, neighbours, most);
  return clique_.size() > before;
}

void MaxClique::search(std::size_t v, std::span<const std::size_t> neighbours, std::size_t most) {
  std::vector<std::size_t> known;
  for (const std::size_t u : clique_)
    if (graph_.adjacent(u, v)) known.push_back(u);
  known.push_back(v);
  if (known.size() == most) {
    clique_ = std::move(known);
  } else {
    adopt(greedy_extension(graph_, std::move(known), clique_.size()));
    if (clique_.size() < most) adopt(greedy_extension(graph_, {v}, clique_.size()));
  }
  if (clique_.size() < most)
    search_tree(v, neighbours, most);
  else
    bound_ = std::max(bound_, most);
}

void MaxClique::search_tree(std::size_t v, std::span<const std::size_t> neighbours,
                            std::size_t most) {
  CliqueSearch search = find_clique(
      graph_, neighbours,
      {.more_than = clique_.size() - 1, .enough = most - 1, .max_nodes = max_search_nodes_});
  search_nodes_ += search.nodes;
  searches_ended_ += search.proven ? 0 : 1;
  bound_ = std::max(bound_, std::min(most, search.bound + 1));
  if (search.clique.empty()) return;
  search.clique.push_back(v);
  adopt(std::move(search.clique));
}

void MaxClique::adopt(std::vector<std::size_t> clique) {
  if (clique.size() <= clique_.size()) return;
  verify(graph_, clique);
  clique_ = std::move(clique);
}

}  // namespace km
