#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "modules/outlier_rejection/bit_graph.hpp"

namespace km {

/// Maximum clique of a graph that grows by one vertex at a time.
///
/// A clique larger than the one known must contain the new vertex (Chang et al., "Kimera-Multi",
/// ICRA 2021, Sec. III-B), so only its neighbours are searched, only for cliques larger than the
/// known one, and, where that one is proven to be a maximum, only until one vertex is gained: no
/// vertex can add more. Unlike the paper's, the search is exact. Of equally large cliques the
/// older one is kept. Deterministic. Not thread-safe. Copyable.
class MaxClique {
 public:
  /// `max_search_nodes` bounds the search tree of one add(); see proven().
  explicit MaxClique(std::uint64_t max_search_nodes) : max_search_nodes_(max_search_nodes) {}

  /// Adds vertex number size(), with edges to the `neighbours`, distinct and below size().
  /// Returns true if the clique grew. Throws std::invalid_argument for other neighbours; state is
  /// unchanged then.
  bool add(std::span<const std::size_t> neighbours);

  [[nodiscard]] std::size_t size() const { return graph_.size(); }

  /// The largest clique found, ascending. Valid until the next add().
  [[nodiscard]] std::span<const std::size_t> clique() const { return clique_; }

  /// False if the bound ended a search: clique() may then be smaller than the maximum.
  [[nodiscard]] bool proven() const { return proven_; }

  /// Nodes of all search trees so far.
  [[nodiscard]] std::uint64_t search_nodes() const { return search_nodes_; }

 private:
  [[nodiscard]] std::vector<std::size_t> larger_clique_with(
      std::size_t v, std::span<const std::size_t> neighbours);

  std::uint64_t max_search_nodes_;
  BitGraph graph_;
  std::vector<std::size_t> clique_;
  bool proven_ = true;
  std::uint64_t search_nodes_ = 0;
};

}  // namespace km
