#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "modules/pose_graph/g2o_io.hpp"
#include "test/support/pose_graph_problems.hpp"

namespace km {

/// The files of a team's robots as one graph, and the poses they ended with.
struct TeamResult {
  WholeGraph graph;
  std::vector<SE3> poses;
};

/// Of robots 0 to `robots` - 1, whose results are in robot0, robot1, ...
inline TeamResult read_team(const std::filesystem::path& folder, int robots) {
  std::vector<G2oGraph> parts;
  std::map<KeyframeId, Eigen::Index> index_of;
  TeamResult team;
  for (int i = 0; i < robots; ++i) {
    parts.push_back(read_g2o(folder / ("robot" + std::to_string(i)) / "pose_graph.g2o"));
    for (const G2oVertex& vertex : parts.back().vertices) {
      index_of[vertex.id] = team.graph.poses++;
      team.poses.push_back(vertex.T_world_kf);
    }
  }
  for (RobotId robot = 0; robot < robots; ++robot)
    for (const RelativePose& edge : parts[robot].edges)
      if (edge.from.robot == robot)  // an edge between two robots is in the files of both
        team.graph.edges.push_back(block_edge(index_of.at(edge.from), index_of.at(edge.to), edge));
  return team;
}

/// Chordal cost, without 1/2.
inline double cost_of(const WholeGraph& graph, const std::vector<SE3>& poses) {
  double cost = 0.0;
  for (const BlockEdge& edge : graph.edges) {
    const auto block = [&](Eigen::Index i) -> Eigen::MatrixXd {
      return poses[static_cast<std::size_t>(i)].matrix().topRows<3>();
    };
    cost += edge_cost(block(edge.i), block(edge.j), edge.T_i_j, edge.kappa, edge.tau);
  }
  return cost;
}

}  // namespace km
