#include "modules/outlier_rejection/clique_search.hpp"

#include <algorithm>
#include <deque>

namespace km {
namespace {

using Vertices = std::vector<std::size_t>;

// Vertices of the k-core of the subgraph that `candidates` induce: each has at least k neighbours
// in the core. The order is the reverse of the degeneracy order, which repeatedly removes the
// vertex of least degree, so that the densest part comes first.
Vertices core_in_degeneracy_order(const BitGraph& graph, std::span<const std::size_t> candidates,
                                  std::size_t k) {
  BitSet members(graph.capacity());
  for (const std::size_t v : candidates) members.insert(v);
  struct Entry {
    std::size_t vertex, degree;
  };
  std::vector<Entry> left;
  for (const std::size_t v : candidates)
    left.push_back({v, graph.neighbours(v).count_common(members)});

  Vertices order;
  while (!left.empty()) {
    const auto least =
        std::min_element(left.begin(), left.end(),
                         [](const Entry& x, const Entry& y) { return x.degree < y.degree; });
    const Entry taken = *least;
    *least = left.back();
    left.pop_back();
    const BitSet& neighbours = graph.neighbours(taken.vertex);
    for (Entry& entry : left) entry.degree -= neighbours.contains(entry.vertex) ? 1 : 0;
    if (taken.degree >= k || !order.empty()) order.push_back(taken.vertex);
  }
  std::reverse(order.begin(), order.end());
  return order;
}

// True if a greedy colouring of the candidates, in the order of their numbers, needs at most
// `colours` colours. The candidates then have no larger clique. This test is cheap and most often
// sufficient.
bool is_colourable(const BitGraph& graph, std::span<const std::size_t> candidates,
                   std::size_t colours) {
  BitSet uncoloured(graph.capacity());
  for (const std::size_t v : candidates) uncoloured.insert(v);
  BitSet rest;
  for (std::size_t c = 0; c < colours && uncoloured.next(0); ++c) {
    rest = uncoloured;
    for (auto v = rest.next(0); v; v = rest.next(*v + 1)) {
      uncoloured.erase(*v);
      rest.subtract(graph.neighbours(*v));
    }
  }
  return !uncoloured.next(0);
}

BitGraph induced(const BitGraph& graph, const Vertices& vertices) {
  BitGraph result(vertices.size());
  for (std::size_t i = 0; i < vertices.size(); ++i)
    for (std::size_t k = 0; k < i; ++k)
      if (graph.adjacent(vertices[i], vertices[k])) result.connect(i, k);
  return result;
}

// Depth-first branch and bound over all vertices of a graph.
class BranchAndBound {
 public:
  BranchAndBound(const BitGraph& graph, const CliqueGoal& goal)
      : graph_(graph), goal_(goal), best_size_(goal.more_than), root_bound_(graph.size()) {}

  CliqueSearch run() {
    levels_.emplace_back();
    levels_[0].candidates = BitSet(graph_.capacity());
    for (std::size_t v = 0; v < graph_.size(); ++v) levels_[0].candidates.insert(v);
    expand(0);
    result_.bound = result_.proven ? best_size_ : std::max(best_size_, root_bound_);
    return std::move(result_);
  }

 private:
  struct Level {
    BitSet candidates, uncoloured, rest;
    std::vector<BitSet> colours;     // colour classes (independent sets), colour c at index c - 1
    Vertices order;                  // vertices that could lead to a larger clique
    std::vector<std::size_t> bound;  // number of colours up to each vertex of `order`
  };

  Level& level(std::size_t depth) {
    if (levels_.size() <= depth) levels_.emplace_back();
    return levels_[depth];
  }

  void expand(std::size_t depth) {
    if (++result_.nodes > goal_.max_nodes) {
      result_.proven = false;
      done_ = true;
      return;
    }
    Level& here = level(depth);
    const std::size_t size = clique_.size();
    take_universal(here);
    if (here.candidates.next(0))
      branch(depth);
    else if (clique_.size() > best_size_)
      record();
    clique_.resize(size);
  }

  // Moves candidates that are adjacent to all other candidates to the clique, because a largest
  // clique contains them.
  void take_universal(Level& here) {
    for (auto v = here.candidates.next(0); v; v = here.candidates.next(*v + 1)) {
      if (!here.candidates.all_but_one_in(*v, graph_.neighbours(*v))) continue;
      here.candidates.erase(*v);
      clique_.push_back(*v);
    }
  }

  void branch(std::size_t depth) {
    Level& here = level(depth);
    const std::size_t taken = clique_.size();
    colour_candidates(here, best_size_ - std::min(best_size_, taken));
    while (!here.order.empty() && !done_) {
      if (taken + here.bound.back() <= best_size_) return;
      if (depth == 0) root_bound_ = taken + here.bound.back();
      const std::size_t v = here.order.back();
      here.order.pop_back();
      here.bound.pop_back();
      clique_.push_back(v);
      Level& below = level(depth + 1);
      below.candidates.assign_intersection(here.candidates, graph_.neighbours(v));
      expand(depth + 1);
      clique_.pop_back();
      here.candidates.erase(v);
    }
  }

  void record() {
    best_size_ = clique_.size();
    result_.clique = clique_;
    done_ = best_size_ >= goal_.enough;
  }

  // A clique contains at most one vertex of each colour. Only vertices of a colour above `spare`
  // can lead to a clique larger than the best, so only these enter `order`.
  void colour_candidates(Level& here, std::size_t spare) {
    here.order.clear();
    here.bound.clear();
    here.uncoloured = here.candidates;
    std::size_t colours = 0;
    for (auto first = here.uncoloured.next(0); first; first = here.uncoloured.next(*first)) {
      if (here.colours.size() == colours) here.colours.emplace_back(graph_.capacity());
      BitSet& colour = here.colours[colours++];
      colour.clear();
      BitSet& rest = here.rest;
      rest = here.uncoloured;
      for (auto v = first; v; v = rest.next(*v + 1)) {
        here.uncoloured.erase(*v);
        if (colours > spare && recolour(here, *v, spare)) continue;
        rest.subtract(graph_.neighbours(*v));
        colour.insert(*v);
        if (colours <= spare) continue;
        here.order.push_back(*v);
        here.bound.push_back(colours);
      }
    }
  }

  // Tries to give v one of the first `spare` colours. The only conflicting vertex of this colour
  // then gets another of the first `spare` colours.
  bool recolour(Level& here, std::size_t v, std::size_t spare) {
    for (std::size_t c = 0; c + 1 < spare; ++c) {
      BitSet& colour = here.colours[c];
      const auto w = colour.only_common(graph_.neighbours(v));
      if (!w) continue;
      for (std::size_t d = c + 1; d < spare; ++d) {
        if (here.colours[d].intersects(graph_.neighbours(*w))) continue;
        colour.erase(*w);
        here.colours[d].insert(*w);
        colour.insert(v);
        return true;
      }
    }
    return false;
  }

  const BitGraph& graph_;
  const CliqueGoal goal_;
  std::size_t best_size_;
  std::size_t root_bound_;  // bound on cliques with a vertex that the root has not finished
  Vertices clique_;
  std::deque<Level> levels_;  // no vector, so that references to levels stay valid
  CliqueSearch result_;
  bool done_ = false;
};

}  // namespace

CliqueSearch find_clique(const BitGraph& graph, std::span<const std::size_t> candidates,
                         const CliqueGoal& goal) {
  const CliqueSearch none{.clique = {}, .proven = true, .bound = goal.more_than, .nodes = 0};
  if (is_colourable(graph, candidates, goal.more_than)) return none;
  const Vertices vertices = core_in_degeneracy_order(graph, candidates, goal.more_than);
  if (vertices.size() <= goal.more_than) return none;
  const BitGraph subgraph = induced(graph, vertices);
  CliqueSearch result = BranchAndBound(subgraph, goal).run();
  for (std::size_t& v : result.clique) v = vertices[v];
  std::sort(result.clique.begin(), result.clique.end());
  return result;
}

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

}  // namespace km
