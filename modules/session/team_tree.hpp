#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "modules/core/team_links.hpp"

namespace km {

/// Number of closures between two robots, the lower id first.
using PairClosures = std::map<std::pair<RobotId, RobotId>, std::uint32_t>;

/// A tree of robots: the neighbours of each.
using RobotTree = std::map<RobotId, std::vector<RobotId>>;

/// The tree over which the solvers of a session send their messages. An edge of the tree divides
/// the team, and its messages grow with the closures between the two sides: the second derivatives
/// with their square, gradients and steps linearly. There are two trees:
///
/// - the maximum spanning tree over links, weighted by closures (Kruskal's algorithm; ties: lowest
///   ids). If links do not connect the robots, paths with the fewest hops over other robots do.
/// - the elimination tree (Liu, SIAM J. Matrix Anal. Appl. 1990) of the graph of robots: closures
///   join only ancestors and descendants. The robot is eliminated next whose subtree has the fewest
///   closures to the rest of the team (ties: least depth, lowest id). A robot and its parent may be
///   without a link; each hop between them counts.
///
/// The second one is taken if it halves the sum of the messages over its edges. Precondition:
/// closures connect the robots.
[[nodiscard]] RobotTree choose_tree(const std::set<RobotId>& robots, const PairClosures& closures,
                                    const TeamLinks& links);

/// The elimination tree above. Precondition: closures connect the robots.
[[nodiscard]] RobotTree elimination_tree(const std::set<RobotId>& robots,
                                         const PairClosures& closures);

/// Parents of all robots of `tree` below the root `root`, in order of their depth.
[[nodiscard]] std::vector<std::pair<RobotId, RobotId>> parents_below(RobotId root,
                                                                     const RobotTree& tree);

/// The robot from which the farthest robot is nearest, twice; or the two such robots, the lower id
/// first.
[[nodiscard]] std::pair<RobotId, RobotId> centre_of(const std::set<RobotId>& robots,
                                                    const RobotTree& tree);

}  // namespace km
