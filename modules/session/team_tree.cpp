#include "modules/session/team_tree.hpp"

#include <algorithm>
#include <limits>
#include <tuple>

namespace km {
namespace {

// The robot, its parent, and so on up to the root.
std::vector<RobotId> path_up(RobotId robot, const std::map<RobotId, RobotId>& parent_of) {
  std::vector<RobotId> path{robot};
  for (auto parent = parent_of.find(robot); parent != parent_of.end();
       parent = parent_of.find(path.back()))
    path.push_back(parent->second);
  return path;
}

}  // namespace

RobotTree choose_tree(const std::set<RobotId>& robots, const PairClosures& closures,
                      const TeamLinks& links) {
  constexpr std::size_t kNoPath = std::numeric_limits<std::size_t>::max();
  // Hops, minus the closures, and the robots: ascending, the best edge is the first.
  std::vector<std::tuple<std::size_t, std::int64_t, RobotId, RobotId>> possible;
  for (const RobotId a : robots) {
    const auto distances = links.distances(a);
    for (auto b = robots.upper_bound(a); b != robots.end(); ++b) {
      const auto distance = distances.find(*b);
      const auto between = closures.find({a, *b});
      possible.emplace_back(distance == distances.end() ? kNoPath : distance->second,
                            between == closures.end() ? 0 : -std::int64_t{between->second}, a, *b);
    }
  }
  std::ranges::sort(possible);
  std::map<RobotId, RobotId> part_of;  // a part is identified by one of its robots
  for (const RobotId robot : robots) part_of[robot] = robot;
  RobotTree tree;
  for (const auto& [hops, fewer, a, b] : possible) {
    const RobotId absorbed = part_of.at(a), into = part_of.at(b);
    if (absorbed == into) continue;
    for (auto& [robot, part] : part_of)
      if (part == absorbed) part = into;
    tree[a].push_back(b);
    tree[b].push_back(a);
  }
  return tree;
}

std::vector<std::pair<RobotId, RobotId>> parents_below(RobotId root, const RobotTree& tree) {
  std::vector<std::pair<RobotId, RobotId>> parents;
  std::vector<std::pair<RobotId, RobotId>> open{{root, root}};
  for (std::size_t k = 0; k < open.size(); ++k) {
    const auto [robot, parent] = open[k];
    if (k > 0) parents.emplace_back(robot, parent);
    const auto neighbours = tree.find(robot);
    if (neighbours == tree.end()) continue;
    for (const RobotId neighbour : neighbours->second)
      if (neighbour != parent || k == 0) open.emplace_back(neighbour, robot);
  }
  return parents;
}

// The middle of a longest path. From any robot, the farthest one is an end of such a path.
std::pair<RobotId, RobotId> centre_of(const std::set<RobotId>& robots, const RobotTree& tree) {
  const auto path_to_farthest = [&](RobotId from) {
    const auto parents = parents_below(from, tree);
    const std::map<RobotId, RobotId> parent_of(parents.begin(), parents.end());
    return path_up(parents.empty() ? from : parents.back().first, parent_of);
  };
  const std::vector<RobotId> longest = path_to_farthest(path_to_farthest(*robots.begin()).front());
  return std::minmax(longest[(longest.size() - 1) / 2], longest[longest.size() / 2]);
}

}  // namespace km
