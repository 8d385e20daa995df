#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "modules/outlier_rejection/bit_graph.hpp"

namespace km {

/// A large clique of a graph that grows by one vertex at a time, by the heuristics with which the
/// paper compares. One is greedy_extension() from the new vertex (Chang et al., "Kimera-Multi",
/// ICRA 2021). The other starts from every vertex, from scratch (Pattabiraman et al., "Fast
/// Algorithms for the Maximum Clique Problem on Massive Graphs", Internet Mathematics 2015). The
/// older of equally large cliques is kept. Deterministic. Not thread-safe.
class GreedyClique {
 public:
  enum class Starts { kNewVertex, kAllVertices };
  explicit GreedyClique(Starts starts) : starts_(starts) {}

  /// Adds vertex number size(), with edges to the `neighbours`. Precondition: they are distinct and
  /// below size().
  void add(std::span<const std::size_t> neighbours);

  [[nodiscard]] std::size_t size() const { return graph_.size(); }
  /// The largest clique found, ascending.
  [[nodiscard]] std::span<const std::size_t> clique() const { return clique_; }
  /// No clique of the graph is larger than this, by its degrees.
  [[nodiscard]] std::size_t bound() const { return bound_; }

 private:
  Starts starts_;
  BitGraph graph_;
  std::vector<std::size_t> clique_;
  std::size_t bound_ = 0;
};

}  // namespace km
