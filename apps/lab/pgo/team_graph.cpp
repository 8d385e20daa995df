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

std::vector<bool> odometry_edges(const TeamGraph& graph) {
  std::vector<bool> odometry;
  std::set<KeyframeId> has_step;
  for (const BlockEdge& e : graph.edges) {
    const KeyframeId& from = graph.ids[static_cast<std::size_t>(e.i)];
    const KeyframeId& to = graph.ids[static_cast<std::size_t>(e.j)];
    const bool step = from.robot == to.robot && e.j == e.i + 1;
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

std::vector<PoseEdge> odometry_steps(const TeamGraph& graph, std::size_t robot) {
  std::vector<PoseEdge> steps;
  for (Eigen::Index i = graph.first[robot]; i + 1 < graph.first[robot + 1]; ++i) {
    steps.push_back(unknown_step(graph.keyframe_of(i)));
    const auto vertex = graph.vertices.begin() + i;
    if (!graph.vertices.empty()) steps.back().T_from_to = vertex[0].inverse() * vertex[1];
  }
  const std::vector<bool> odometry = odometry_edges(graph);
  for (std::size_t k = 0; k < odometry.size(); ++k) {
    const BlockEdge& e = graph.edges[k];
    const KeyframeId from = graph.keyframe_of(e.i), to = graph.keyframe_of(e.j);
    if (odometry[k] && from.robot == robot && to.robot == robot)
      steps[from.index] = {from, to, e.T_i_j, {e.kappa, e.tau}};
  }
  return steps;
}

SessionGraph part_of(const TeamGraph& graph, std::size_t robot) {
  SessionGraph part{.self = static_cast<RobotId>(robot), .upright = !graph.verticals.empty()};
  const std::vector<bool> odometry = odometry_edges(graph);
  std::map<RobotId, std::size_t> steps;
  part.own = odometry_steps(graph, robot);
  part.odometry = part.own.size();
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
    if (!inside || !odometry[k]) (inside ? part.own : part.between).push_back(edge);
  }
  std::stable_sort(part.between.begin(), part.between.end(),
                   [](const PoseEdge& a, const PoseEdge& b) { return a.id() < b.id(); });
  for (const VerticalPrior& prior : graph.verticals)
    if (graph.robot_of(prior.pose) == robot)
      part.verticals.push_back({prior.pose - graph.first[robot], prior.up, prior.weight});
  return part;
}

SessionGraph whole_session(const TeamGraph& graph, std::vector<SE3> start) {
  SessionGraph whole{
      .start = std::move(start), .verticals = graph.verticals, .upright = !graph.verticals.empty()};
  for (const BlockEdge& e : graph.edges) whole.own.push_back(e.of_one_robot());
  return whole;
}

QuadraticProblem problem_of(const TeamGraph& graph, Eigen::Index rank) {
  return {rank, graph.poses(), graph.edges, {}, graph.verticals};
}

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
