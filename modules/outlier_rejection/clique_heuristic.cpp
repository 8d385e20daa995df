#include "modules/outlier_rejection/clique_heuristic.hpp"

#include <algorithm>

namespace km {

std::vector<std::size_t> greedy_extension(const BitGraph& graph, std::vector<std::size_t> clique,
                                          std::size_t more_than) {
  for (const std::size_t v : clique)
    if (graph.degree(v) < more_than) return {};
  BitSet adjacent_to_all = graph.neighbours(clique.front());
  for (const std::size_t v : clique) adjacent_to_all.intersect(graph.neighbours(v));
  std::vector<std::size_t> by_degree;
  for (auto u = adjacent_to_all.next(0); u; u = adjacent_to_all.next(*u + 1))
    if (graph.degree(*u) >= more_than) by_degree.push_back(*u);
  if (clique.size() + by_degree.size() <= more_than) return {};
  std::stable_sort(by_degree.begin(), by_degree.end(),
                   [&](std::size_t x, std::size_t y) { return graph.degree(x) > graph.degree(y); });

  for (const std::size_t u : by_degree) {
    if (!adjacent_to_all.contains(u)) continue;
    clique.push_back(u);
    adjacent_to_all.intersect(graph.neighbours(u));
  }
  if (clique.size() <= more_than) return {};
  std::sort(clique.begin(), clique.end());
  return clique;
}

std::vector<std::size_t> greedy_clique(const BitGraph& graph) {
  std::vector<std::size_t> best;
  for (std::size_t v = 0; v < graph.size(); ++v) {
    std::vector<std::size_t> clique = greedy_extension(graph, {v}, best.size());
    if (!clique.empty()) best = std::move(clique);
  }
  return best;
}

}  // namespace km
