#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "modules/outlier_rejection/bit_graph.hpp"

namespace km {

/// Maximum clique of a graph that grows by one vertex at a time.
///
/// A clique larger than the known one must contain the new vertex (Chang et al., "Kimera-Multi",
/// ICRA 2021, Sec. III-B). The search is therefore limited to the neighbours of the new vertex, and
/// to cliques larger than the known one. One vertex increases the maximum by at most one, so the
/// search stops when a proven maximum has grown by one. The older of equally large cliques is kept.
/// Deterministic. Not thread-safe. Copyable.
///
/// The search first runs the greedy heuristic, which is cheap: from the new vertex with its
/// neighbours in the known clique, and from the vertex alone. The search tree then finds a larger
/// clique or proves that there is none. If max_search_nodes ends the search, the larger of both
/// cliques counts, and bound() is an upper bound on the maximum.
class MaxClique {
 public:
  /// Bounds an addition to some ten milliseconds (README, Limits).
  static constexpr std::uint64_t kMaxSearchNodes = 10000;

  /// `max_search_nodes` bounds the search tree of one add().
  explicit MaxClique(std::uint64_t max_search_nodes) : max_search_nodes_(max_search_nodes) {}

  /// Adds vertex number size(), with edges to the `neighbours`, distinct and below size().
  /// Returns true if the clique grew. Throws std::invalid_argument for other neighbours; the state
  /// is then unchanged. The clique never shrinks.
  bool add(std::span<const std::size_t> neighbours);

  [[nodiscard]] std::size_t size() const { return graph_.size(); }

  /// The largest clique found, ascending. Valid until the next add().
  [[nodiscard]] std::span<const std::size_t> clique() const { return clique_; }

  /// No clique of the graph is larger than this.
  [[nodiscard]] std::size_t bound() const { return bound_; }

  /// True if clique() is a proven maximum. False after max_search_nodes has ended a search, until a
  /// clique as large as the bound is found.
  [[nodiscard]] bool proven() const { return clique_.size() == bound_; }

  /// Number of nodes of all search trees so far.
  [[nodiscard]] std::uint64_t search_nodes() const { return search_nodes_; }
  /// Number of searches that max_search_nodes has ended.
  [[nodiscard]] std::size_t searches_ended() const { return searches_ended_; }

 private:
  // Searches for a larger clique with the new vertex v. `most`: upper bound on the size of such a
  // clique.
  void search(std::size_t v, std::span<const std::size_t> neighbours, std::size_t most);
  void search_tree(std::size_t v, std::span<const std::size_t> neighbours, std::size_t most);
  void adopt(std::vector<std::size_t> clique);

  std::uint64_t max_search_nodes_;
  BitGraph graph_;
  std::vector<std::size_t> clique_;
  std::size_t bound_ = 0;
  std::uint64_t search_nodes_ = 0;
  std::size_t searches_ended_ = 0;
};

}  // namespace km
