#pragma once

#include <cstddef>
#include <vector>

#include "modules/pgo_study/team_graph.hpp"

namespace km {

/// A connected part of a team's graph, with robots, poses and edges in the order of the whole.
struct ConnectedPart {
  TeamGraph graph;                 ///< Of the robots that have a pose in it.
  std::vector<std::size_t> poses;  ///< [i]: number of pose i in the whole graph.
  std::vector<std::size_t> edges;  ///< [k]: number of edge k in the whole graph.
};

/// The connected parts of what is left of `graph` with the poses and edges that are kept, ascending
/// by their first pose. An edge whose end is not kept is left out. Preconditions: `keep_pose` and
/// `keep_edge` have an element for each pose and each edge.
[[nodiscard]] std::vector<ConnectedPart> connected_parts(const TeamGraph& graph,
                                                         const std::vector<bool>& keep_pose,
                                                         const std::vector<bool>& keep_edge);

}  // namespace km
