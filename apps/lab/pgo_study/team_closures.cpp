#include "apps/lab/pgo_study/team_closures.hpp"

#include <algorithm>
#include <iterator>
#include <stdexcept>
#include <utility>

#include "modules/pose_graph/corroboration.hpp"
#include "modules/recorded_graph/recorded_graph.hpp"

namespace km {
namespace {

// An edge in the robots' own numbering of poses.
RelativePose relative_pose(const TeamGraph& graph, const BlockEdge& e, double noise_scale) {
  return {graph.keyframe_of(e.i), graph.keyframe_of(e.j), e.T_i_j,
          noise_scale * noise_scale * covariance_in({e.kappa, e.tau}, graph.dimension)};
}

bool inside_a_robot(const TeamGraph& graph, const BlockEdge& e) {
  return graph.robot_of(e.i) == graph.robot_of(e.j);
}

}  // namespace

std::vector<std::vector<RelativePose>> team_odometry(const TeamGraph& graph, double noise_scale) {
  const std::vector<bool> odometry = odometry_edges(graph);
  std::vector<std::vector<RelativePose>> steps(graph.robots());
  for (std::size_t k = 0; k < odometry.size(); ++k)
    if (odometry[k] && inside_a_robot(graph, graph.edges[k]))
      steps[graph.robot_of(graph.edges[k].i)].push_back(
          relative_pose(graph, graph.edges[k], noise_scale));
  for (std::size_t robot = 0; robot < graph.robots(); ++robot) {
    std::ranges::sort(steps[robot], {}, [](const RelativePose& step) { return step.from; });
    std::size_t chained = 0;
    while (chained < steps[robot].size() && steps[robot][chained].from.index == chained) ++chained;
    const auto pose = static_cast<std::size_t>(graph.first[robot]) + chained + 1;
    if (chained + 1 < static_cast<std::size_t>(graph.poses_of(robot)))
      throw std::invalid_argument("no odometry leads to pose " + to_string(graph.ids[pose]));
  }
  return steps;
}

std::vector<TeamClosure> team_closures(const TeamGraph& graph, double noise_scale) {
  std::vector<OdometryPose> poses;
  const auto odometry = team_odometry(graph, noise_scale);
  for (std::size_t robot = 0; robot < graph.robots(); ++robot) {
    RecordedGraph chain;
    chain.robot = static_cast<RobotId>(robot);
    chain.odometry = odometry[robot];
    std::ranges::move(odometry_poses(chain), std::back_inserter(poses));
  }
  const std::vector<bool> step = odometry_edges(graph);
  std::vector<TeamClosure> closures;
  for (std::size_t k = 0; k < graph.edges.size(); ++k) {
    const BlockEdge& e = graph.edges[k];
    if (step[k] && inside_a_robot(graph, e)) continue;
    const RelativePose measured = relative_pose(graph, e, noise_scale);
    closures.push_back({k, Closure{.from = poses[static_cast<std::size_t>(e.i)],
                                   .to = poses[static_cast<std::size_t>(e.j)],
                                   .T_from_to = measured.T_from_to,
                                   .covariance = measured.covariance}});
  }
  return closures;
}

}  // namespace km
