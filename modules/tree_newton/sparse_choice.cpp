#include "modules/tree_newton/sparse_choice.hpp"

#include <bit>
#include <cstdint>
#include <map>
#include <queue>

namespace km {
namespace {

// A graph with one row of bits per node: eliminating a node is an OR of rows.
class BitGraph {
 public:
  explicit BitGraph(std::size_t nodes) : words_((nodes + 63) / 64), bits_(words_ * nodes, 0) {}

  void couple(int i, int j) {
    row(i)[j / 64] |= mask(j);
    row(j)[i / 64] |= mask(i);
  }

  // Couples all of these nodes with each other.
  void couple(const std::vector<int>& nodes) {
    std::vector<std::uint64_t> all(words_, 0);
    for (const int v : nodes) all[at(v) / 64] |= mask(v);
    for (const int v : nodes) {
      for (std::size_t w = 0; w < words_; ++w) row(v)[w] |= all[w];
      clear(v, v);
    }
  }

  // Number of couplings that eliminating `v` adds, minus those that it removes.
  [[nodiscard]] int growth(int v) const {
    const std::uint64_t* own = row(v);
    int degree = 0;
    for (std::size_t w = 0; w < words_; ++w) degree += std::popcount(own[w]);
    int coupled = 0;  // coupled neighbours, each pair counted twice
    for_neighbours(v, [&](int u) {
      const std::uint64_t* other = row(u);
      for (std::size_t w = 0; w < words_; ++w) coupled += std::popcount(own[w] & other[w]);
    });
    return (degree * (degree - 1) - coupled) / 2 - degree;
  }

  // Removes `v`, couples its neighbours, and returns them.
  std::vector<int> eliminate(int v) {
    std::vector<int> neighbours;
    for_neighbours(v, [&](int u) { neighbours.push_back(u); });
    for (const int u : neighbours) {
      std::uint64_t* other = row(u);
      for (std::size_t w = 0; w < words_; ++w) other[w] |= row(v)[w];
      clear(u, u);
      clear(u, v);
    }
    return neighbours;
  }

 private:
  std::uint64_t* row(int v) { return bits_.data() + words_ * at(v); }
  [[nodiscard]] const std::uint64_t* row(int v) const { return bits_.data() + words_ * at(v); }
  static std::uint64_t mask(int v) { return std::uint64_t{1} << (static_cast<unsigned>(v) % 64U); }
  void clear(int i, int j) { row(i)[j / 64] &= ~mask(j); }

  template <typename F>
  void for_neighbours(int v, F&& f) const {
    const std::uint64_t* own = row(v);
    for (std::size_t w = 0; w < words_; ++w)
      for (std::uint64_t left = own[w]; left != 0; left &= left - 1)
        f(static_cast<int>(64 * w) + std::countr_zero(left));
  }

  std::size_t words_;
  std::vector<std::uint64_t> bits_;
};

enum class State { kKept, kOffered, kOutdated, kEliminated };

// The graph that is left after nodes are eliminated. Only its size is squared, not that of the
// whole graph, in which nearly all poses of a long run are eliminated.
struct Remainder {
  std::vector<std::size_t> nodes;  // ascending
  BitGraph graph{0};
};

// Couples the neighbours of each connected group of nodes that are `gone`.
Remainder without(const std::vector<bool>& gone, const std::vector<NodePair>& pairs) {
  Remainder left;
  std::vector<int> place(gone.size());  // in `left`, or the next node of the group towards its root
  for (std::size_t v = 0; v < gone.size(); ++v) {
    place[v] = static_cast<int>(gone[v] ? v : left.nodes.size());
    if (!gone[v]) left.nodes.push_back(v);
  }
  const auto root = [&place](int v) {
    while (place[at(v)] != v) v = place[at(v)] = place[at(place[at(v)])];
    return v;
  };
  for (const auto& [i, j] : pairs)
    if (gone[at(i)] && gone[at(j)]) place[at(root(i))] = root(j);
  left.graph = BitGraph(left.nodes.size());
  std::map<int, std::vector<int>> around;  // neighbours of a group, by its root
  for (const auto& [i, j] : pairs) {
    if (gone[at(i)] && gone[at(j)]) continue;
    if (gone[at(i)])
      around[root(i)].push_back(place[at(j)]);
    else if (gone[at(j)])
      around[root(j)].push_back(place[at(i)]);
    else
      left.graph.couple(place[at(i)], place[at(j)]);
  }
  for (const auto& [group, neighbours] : around) left.graph.couple(neighbours);
  return left;
}

}  // namespace

std::vector<bool> keep_sparse(std::vector<bool> keep, const std::vector<NodePair>& pairs,
                              std::vector<bool> eliminate_first) {
  eliminate_first.resize(keep.size(), false);
  for (std::size_t v = 0; v < keep.size(); ++v) eliminate_first[v] = eliminate_first[v] && !keep[v];
  auto [nodes, graph] = without(eliminate_first, pairs);

  // The growth of a node with a changed neighbourhood is not computed again at once. It is computed
  // when the node reaches the front of the queue by its old growth, or when the queue is empty. In
  // a dense graph, an update after each elimination would be too expensive.
  std::vector<State> state(nodes.size(), State::kKept);
  std::priority_queue<std::pair<int, int>> queue;  // least growth first, then lowest node
  const auto offer = [&, &graph = graph](std::size_t v) {
    state[v] = State::kOffered;
    queue.emplace(-graph.growth(static_cast<int>(v)), -static_cast<int>(v));
  };
  for (std::size_t v = 0; v < nodes.size(); ++v)
    if (!keep[nodes[v]]) offer(v);
  const auto eliminate = [&, &graph = graph](int v) {
    state[at(v)] = State::kEliminated;
    for (const int u : graph.eliminate(v))
      if (state[at(u)] == State::kOffered) state[at(u)] = State::kOutdated;
  };
  bool progress = true;
  while (progress) {
    progress = false;
    while (!queue.empty()) {
      const auto [value, negative] = queue.top();
      const auto v = at(-negative);
      if (state[v] == State::kOutdated) {
        queue.pop();
        offer(v);
        continue;
      }
      if (-value > 0) break;
      queue.pop();
      eliminate(-negative);
      progress = true;
    }
    queue = {};
    for (std::size_t v = 0; v < nodes.size(); ++v)
      if (state[v] == State::kOffered || state[v] == State::kOutdated) offer(v);
  }
  keep.assign(keep.size(), false);
  for (std::size_t v = 0; v < nodes.size(); ++v) keep[nodes[v]] = state[v] != State::kEliminated;
  return keep;
}

}  // namespace km
