#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "modules/core/data/team_links.hpp"

namespace km {

/// Number of closures between two robots, the lower id first.
using PairClosures = std::map<std::pair<RobotId, RobotId>, std::uint32_t>;

/// A tree of robots: the neighbours of each.
using RobotTree = std::map<RobotId, std::vector<RobotId>>;

/// The tree over which the solvers of a session send their messages: the maximum spanning tree over
/// links, weighted by closures (Kruskal's algorithm; ties: lowest ids). If links do not connect the
/// robots, paths with the fewest hops over other robots do.
[[nodiscard]] RobotTree choose_tree(const std::set<RobotId>& robots, const PairClosures& closures,
                                    const TeamLinks& links);

/// Parents of all robots of `tree` below the root `root`, in order of their depth.
[[nodiscard]] std::vector<std::pair<RobotId, RobotId>> parents_below(RobotId root,
                                                                     const RobotTree& tree);

/// The robot from which the farthest robot is nearest, twice; or the two such robots, the lower id
/// first.
[[nodiscard]] std::pair<RobotId, RobotId> centre_of(const std::set<RobotId>& robots,
                                                    const RobotTree& tree);

}  // namespace km
