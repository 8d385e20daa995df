#include "modules/tree_newton/sparse_choice.hpp"

#include <bit>
#include <cstdint>
#include <queue>

namespace km {
namespace {

// A graph with one row of bits per node: eliminating a node is an OR of rows.
class BitGraph {
 public:
  BitGraph(int nodes, const std::vector<NodePair>& pairs)
      : words_((at(nodes) + 63) / 64), bits_(words_ * at(nodes), 0) {
    for (const auto& [i, j] : pairs) {
      set(i, j);
      set(j, i);
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
  void set(int i, int j) { row(i)[j / 64] |= mask(j); }
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

}  // namespace

std::vector<bool> keep_sparse(std::vector<bool> keep, const std::vector<NodePair>& pairs,
                              const std::vector<bool>& eliminate_first) {
  BitGraph graph(static_cast<int>(keep.size()), pairs);

  // The growth of a node with a changed neighbourhood is not computed again at once. It is computed
  // when the node reaches the front of the queue by its old growth, or when the queue is empty. In
  // a dense graph, an update after each elimination would be too expensive.
  std::vector<State> state(keep.size(), State::kKept);
  std::priority_queue<std::pair<int, int>> queue;  // least growth first, then lowest node
  const auto offer = [&](std::size_t v) {
    state[v] = State::kOffered;
    queue.emplace(-graph.growth(static_cast<int>(v)), -static_cast<int>(v));
  };
  // The remaining graph does not depend on the order of these eliminations.
  for (std::size_t v = 0; v < eliminate_first.size(); ++v) {
    if (!eliminate_first[v] || keep[v]) continue;
    state[v] = State::kEliminated;
    (void)graph.eliminate(static_cast<int>(v));
  }
  for (std::size_t v = 0; v < keep.size(); ++v)
    if (!keep[v] && state[v] != State::kEliminated) offer(v);
  const auto eliminate = [&](int v) {
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
    for (std::size_t v = 0; v < keep.size(); ++v)
      if (state[v] == State::kOffered || state[v] == State::kOutdated) offer(v);
  }
  for (std::size_t v = 0; v < keep.size(); ++v) keep[v] = state[v] != State::kEliminated;
  return keep;
}

}  // namespace km
