#include "apps/lab/pgo/connected_parts.hpp"

#include <map>

namespace km {

std::vector<ConnectedPart> connected_parts(const TeamGraph& graph,
                                           const std::vector<bool>& keep_edge) {
  const std::vector<Eigen::Index> lowest = part_of_poses(with_edges(graph, keep_edge));
  std::vector<ConnectedPart> parts;
  std::map<Eigen::Index, std::size_t> part_of_lowest;
  std::vector<std::size_t> last_robot;  // last robot of each part so far
  std::vector<Eigen::Index> number(static_cast<std::size_t>(graph.poses()));
  for (std::size_t i = 0; i < number.size(); ++i) {
    const auto [at, is_new] = part_of_lowest.emplace(lowest[i], parts.size());
    const std::size_t robot = graph.robot_of(static_cast<Eigen::Index>(i));
    if (is_new)
      parts.push_back({.graph = {.dimension = graph.dimension}, .poses = {}, .edges = {}});
    if (is_new) last_robot.push_back(graph.robots());  // none
    ConnectedPart& part = parts[at->second];
    number[i] = static_cast<Eigen::Index>(part.poses.size());
    if (last_robot[at->second] != robot) part.graph.first.push_back(number[i]);
    last_robot[at->second] = robot;
    part.poses.push_back(i);
    part.graph.ids.push_back(graph.ids[i]);
  }
  for (ConnectedPart& part : parts)
    part.graph.first.push_back(static_cast<Eigen::Index>(part.poses.size()));
  for (std::size_t k = 0; k < graph.edges.size(); ++k) {
    if (!keep_edge[k]) continue;
    BlockEdge edge = graph.edges[k];
    ConnectedPart& part = parts[part_of_lowest.at(lowest[static_cast<std::size_t>(edge.i)])];
    edge.i = number[static_cast<std::size_t>(edge.i)];
    edge.j = number[static_cast<std::size_t>(edge.j)];
    part.graph.edges.push_back(edge);
    part.edges.push_back(k);
  }
  for (const VerticalPrior& prior : graph.verticals) {
    const auto pose = static_cast<std::size_t>(prior.pose);
    parts[part_of_lowest.at(lowest[pose])].graph.verticals.push_back(
        {number[pose], prior.up, prior.weight});
  }
  return parts;
}

}  // namespace km
