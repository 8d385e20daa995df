#pragma once

#include <cstddef>
#include <vector>

#include "modules/pgo_study/team_graph.hpp"

namespace km {

/// Robots that share edges with each robot, ascending.
using TeamNeighbours = std::vector<std::vector<std::size_t>>;

[[nodiscard]] TeamNeighbours neighbours_in(const TeamGraph& graph);

/// Groups of robots without common edges, which may move at the same time: greedily, the robot with
/// the most neighbours first.
[[nodiscard]] std::vector<std::vector<std::size_t>> colours_of(const TeamNeighbours& neighbours);

/// Robot 0, then always the neighbours of those before: parent[k] comes before k in `order`.
struct TeamTree {
  std::vector<std::size_t> order;
  std::vector<std::size_t> parent;  ///< Of robot 0: itself.
};

/// Throws std::invalid_argument if robot 0 is not connected with all others.
[[nodiscard]] TeamTree breadth_first_tree(const TeamNeighbours& neighbours);

}  // namespace km
