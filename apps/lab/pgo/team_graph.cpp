#include "apps/lab/pgo/team_graph.hpp"

#include <algorithm>
#include <map>
#include <numeric>
#include <set>
#include <utility>

namespace km {

std::size_t TeamGraph::robot_of(Eigen::Index pose) const {
  return static_cast<std::size_t>(std::upper_bound(first.begin(), first.end(), pose) -
                                  first.begin()) -
         1;
}

KeyframeId TeamGraph::keyframe_of(Eigen::Index pose) const {
  const std::size_t robot = robot_of(pose);
  return {static_cast<RobotId>(robot), static_cast<KeyframeIndex>(pose - first[robot])};
}

PoseEdge edge_of_one_robot(const BlockEdge& edge) {
  return {{0, static_cast<KeyframeIndex>(edge.i)},
          {0, static_cast<KeyframeIndex>(edge.j)},
          edge.T_i_j,
          {edge.kappa, edge.tau}};
}

std::vector<bool> odometry_edges(const TeamGraph& graph) {
  std::vector<bool> odometry;
  std::set<KeyframeId> has_step;
  for (const BlockEdge& e : graph.edges) {
    const KeyframeId& from = graph.ids[static_cast<std::size_t>(e.i)];
    const KeyframeId& to = graph.ids[static_cast<std::size_t>(e.j)];
    const bool step = from.robot == to.robot && to.index == from.index + 1 && e.j == e.i + 1;
    odometry.push_back(step && has_step.insert(from).second);
  }
  return odometry;
}

TeamGraph with_edges(TeamGraph graph, const std::vector<bool>& kept) {
  std::vector<BlockEdge> edges;
  for (std::size_t k = 0; k < kept.size(); ++k)
    if (kept[k]) edges.push_back(graph.edges[k]);
  graph.edges = std::move(edges);
  return graph;
}

TeamGraph without_cut_steps(TeamGraph graph) {
  std::vector<bool> kept = odometry_edges(graph);
  for (std::size_t k = 0; k < kept.size(); ++k) {
    const BlockEdge& e = graph.edges[k];
    kept[k] = !kept[k] || graph.robot_of(e.i) == graph.robot_of(e.j);
  }
  return with_edges(std::move(graph), kept);
}

std::vector<Eigen::Index> part_of_poses(const TeamGraph& graph) {
  std::vector<Eigen::Index> parent(static_cast<std::size_t>(graph.poses()));
  std::iota(parent.begin(), parent.end(), Eigen::Index{0});
  const auto up = [&](Eigen::Index i) -> Eigen::Index& {
    return parent[static_cast<std::size_t>(i)];
  };
  const auto root = [&](Eigen::Index i) {
    while (up(i) != i) i = up(i) = up(up(i));
    return i;
  };
  for (const BlockEdge& e : graph.edges) {
    const auto [low, high] = std::minmax({root(e.i), root(e.j)});
    up(high) = low;
  }
  for (Eigen::Index i = 0; i < graph.poses(); ++i) up(i) = root(i);
  return parent;
}

SessionGraph part_of(const TeamGraph& graph, std::size_t robot) {
  SessionGraph part{.self = static_cast<RobotId>(robot), .upright = !graph.verticals.empty()};
  const std::vector<bool> odometry = odometry_edges(graph);
  std::map<RobotId, std::size_t> steps;
  std::vector<PoseEdge> closures;
  for (std::size_t k = 0; k < graph.edges.size(); ++k) {
    const BlockEdge& e = graph.edges[k];
    const PoseEdge edge{graph.keyframe_of(e.i), graph.keyframe_of(e.j), e.T_i_j, {e.kappa, e.tau}};
    const bool inside = edge.from.robot == edge.to.robot;
    if (odometry[k] && inside) {
      const std::size_t n = ++steps[edge.from.robot];
      Precision& mean =
          part.step_precision.try_emplace(edge.from.robot, edge.precision).first->second;
      mean.kappa += (e.kappa - mean.kappa) / static_cast<double>(n);
      mean.tau += (e.tau - mean.tau) / static_cast<double>(n);
    }
    if (edge.from.robot != part.self && edge.to.robot != part.self) continue;
    (!inside ? part.between : odometry[k] ? part.own : closures).push_back(edge);
    if (!inside && odometry[k]) part.trusted.insert(edge.id());
  }
  part.odometry = part.own.size();
  part.own.insert(part.own.end(), closures.begin(), closures.end());
  std::stable_sort(part.between.begin(), part.between.end(),
                   [](const PoseEdge& a, const PoseEdge& b) { return a.id() < b.id(); });
  for (const VerticalPrior& prior : graph.verticals)
    if (graph.robot_of(prior.pose) == robot)
      part.verticals.push_back({prior.pose - graph.first[robot], prior.up, prior.weight});
  return part;
}

QuadraticProblem problem_of(const TeamGraph& graph, Eigen::Index rank) {
  return {rank, graph.poses(), graph.edges, {}, graph.verticals};
}

}  // namespace km
