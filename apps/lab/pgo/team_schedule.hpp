#pragma once

#include <cstddef>
#include <vector>

#include "apps/lab/pgo/team_graph.hpp"

namespace km {

/// By robot: the robots with which it shares edges, ascending.
using TeamNeighbours = std::vector<std::vector<std::size_t>>;

[[nodiscard]] TeamNeighbours neighbours_in(const TeamGraph& graph);

/// Groups of robots without edges between them, which may move at the same time. The greedy
/// colouring begins with the robot with the most neighbours.
[[nodiscard]] std::vector<std::vector<std::size_t>> colours_of(const TeamNeighbours& neighbours);

/// Breadth-first tree from robot 0. parent[k] comes before k in `order`.
struct TeamTree {
  std::vector<std::size_t> order;
  std::vector<std::size_t> parent;  ///< By robot; the parent of robot 0 is 0.
};

/// Throws std::invalid_argument if robot 0 is not connected with all others.
[[nodiscard]] TeamTree breadth_first_tree(const TeamNeighbours& neighbours);

}  // namespace km
