#pragma once

#include <cstddef>

#include "modules/pose_graph/team/team_graph.hpp"

namespace km {

/// A graph with random false closures, which come after its own edges.
struct SpoiledGraph {
  TeamGraph graph;
  std::size_t own_edges = 0;

  [[nodiscard]] bool is_false(std::size_t edge) const { return edge >= own_edges; }
};

/// Adds `count` false closures: between uniform pairs of poses that do not follow each other, with
/// uniform rotations and translations uniform within +-half_side_m along every axis (in the plane:
/// both). Each claims the weights of a true closure drawn at random. Throws std::invalid_argument
/// if `graph` has no closures to draw from.
[[nodiscard]] SpoiledGraph spoil(const TeamGraph& graph, std::size_t count, double half_side_m,
                                 unsigned seed);

}  // namespace km
