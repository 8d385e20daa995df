#include "modules/pose_graph/team/team_graph.hpp"

#include <algorithm>
#include <set>

namespace km {

std::size_t TeamGraph::robot_of(Eigen::Index pose) const {
  return static_cast<std::size_t>(std::upper_bound(first.begin(), first.end(), pose) -
                                  first.begin()) -
         1;
}

RobotPart part_of(const TeamGraph& graph, std::size_t robot) {
  RobotPart part{.poses = graph.poses_of(robot)};
  const Eigen::Index begin = graph.first[robot];
  for (const BlockEdge& e : graph.edges) {
    const std::size_t robot_i = graph.robot_of(e.i);
    const std::size_t robot_j = graph.robot_of(e.j);
    if (robot_i == robot && robot_j == robot) {
      part.own_edges.push_back({e.i - begin, e.j - begin, e.T_i_j, e.kappa, e.tau});
    } else if (robot_i == robot || robot_j == robot) {
      const bool from_own = robot_i == robot;
      const std::size_t peer = from_own ? robot_j : robot_i;
      const Eigen::Index own = (from_own ? e.i : e.j) - begin;
      const Eigen::Index other = (from_own ? e.j : e.i) - graph.first[peer];
      part.edges_to[static_cast<RobotId>(peer)].push_back({static_cast<std::uint32_t>(own),
                                                           static_cast<std::uint32_t>(other),
                                                           from_own, e.T_i_j, e.kappa, e.tau});
    }
  }
  for (const VerticalPrior& prior : graph.verticals)
    if (graph.robot_of(prior.pose) == robot)
      part.verticals.push_back({prior.pose - begin, prior.up, prior.weight});
  return part;
}

QuadraticProblem problem_of(const TeamGraph& graph, Eigen::Index rank) {
  return {rank, graph.poses(), graph.edges, {}, graph.verticals};
}

std::vector<Eigen::Index> separators_of(const TeamGraph& graph, std::size_t robot) {
  std::set<Eigen::Index> separators;
  for (const BlockEdge& e : graph.edges) {
    const std::size_t robot_i = graph.robot_of(e.i);
    const std::size_t robot_j = graph.robot_of(e.j);
    if (robot_i == robot_j) continue;
    if (robot_i == robot) separators.insert(e.i - graph.first[robot]);
    if (robot_j == robot) separators.insert(e.j - graph.first[robot]);
  }
  return {separators.begin(), separators.end()};
}

}  // namespace km
