#include "apps/lab/pgo/greedy_clique.hpp"

#include <algorithm>
#include <utility>

#include "modules/outlier_rejection/clique_search.hpp"

namespace km {

void GreedyClique::add(std::span<const std::size_t> neighbours) {
  const std::size_t added = graph_.add_vertex();
  for (const std::size_t u : neighbours) graph_.connect(u, added);
  bound_ = std::max(bound_, std::min(bound_, neighbours.size()) + 1);
  const bool from_all = starts_ == Starts::kAllVertices;
  std::size_t least = from_all ? 0 : clique_.size();
  std::vector<std::size_t> best;
  for (std::size_t v = from_all ? 0 : added; v <= added; ++v) {
    std::vector<std::size_t> clique = greedy_extension(graph_, {v}, least);
    if (clique.empty()) continue;
    least = clique.size();
    best = std::move(clique);
  }
  if (best.size() > clique_.size()) clique_ = std::move(best);
}

}  // namespace km
