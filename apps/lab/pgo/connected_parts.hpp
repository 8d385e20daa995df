#pragma once

#include <cstddef>
#include <vector>

#include "apps/lab/pgo/team_graph.hpp"

namespace km {

/// A connected part of a team's graph. Robots, poses and edges keep the order of the whole graph.
struct ConnectedPart {
  TeamGraph graph;                 ///< Graph of the robots that have a pose in the part.
  std::vector<std::size_t> poses;  ///< [i]: number of pose i in the whole graph.
  std::vector<std::size_t> edges;  ///< [k]: number of edge k in the whole graph.
};

/// Returns the connected parts of the subgraph of the kept edges, ascending by their first pose.
/// Precondition: `keep_edge` has an element for each edge.
[[nodiscard]] std::vector<ConnectedPart> connected_parts(const TeamGraph& graph,
                                                         const std::vector<bool>& keep_edge);

}  // namespace km
