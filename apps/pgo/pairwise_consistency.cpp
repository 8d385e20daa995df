#include "apps/pgo/pairwise_consistency.hpp"

#include <algorithm>
#include <iterator>
#include <map>
#include <stdexcept>
#include <string>

#include "modules/outlier_rejection/pcm.hpp"
#include "modules/pose_graph/corroboration.hpp"
#include "modules/pose_graph/recorded_graph.hpp"

namespace km {
namespace {

// An edge in the robots' own numbering of their poses.
RelativePose relative_pose(const TeamGraph& graph, const BlockEdge& e, double noise_scale) {
  const auto id = [&](Eigen::Index pose) {
    const std::size_t robot = graph.robot_of(pose);
    return KeyframeId{static_cast<RobotId>(robot),
                      static_cast<KeyframeIndex>(pose - graph.first[robot])};
  };
  return {id(e.i), id(e.j), e.T_i_j,
          noise_scale * noise_scale * covariance_in({e.kappa, e.tau}, graph.dimension)};
}

// Poses of all robots along their odometry, in the numbering of the graph.
std::vector<OdometryPose> odometry_chains(const TeamGraph& graph, const std::vector<bool>& odometry,
                                          double noise_scale) {
  std::vector<std::vector<RelativePose>> steps(graph.robots());
  for (std::size_t k = 0; k < odometry.size(); ++k) {
    const RelativePose step = relative_pose(graph, graph.edges[k], noise_scale);
    if (odometry[k] && step.from.robot == step.to.robot) steps[step.from.robot].push_back(step);
  }
  std::vector<OdometryPose> poses;
  for (std::size_t robot = 0; robot < graph.robots(); ++robot) {
    RecordedGraph chain;
    chain.robot = static_cast<RobotId>(robot);
    std::ranges::sort(steps[robot], {}, [](const RelativePose& step) { return step.from; });
    for (const RelativePose& step : steps[robot])
      if (step.from.index == chain.odometry.size()) chain.odometry.push_back(step);
    if (static_cast<Eigen::Index>(chain.poses()) != graph.poses_of(robot))
      throw std::invalid_argument(
          "no odometry leads to pose " +
          to_string(graph.ids[static_cast<std::size_t>(graph.first[robot]) + chain.poses()]));
    std::ranges::move(odometry_poses(chain), std::back_inserter(poses));
  }
  return poses;
}

}  // namespace

std::vector<bool> pairwise_consistent(const TeamGraph& graph, const PcmConfig& config,
                                      double noise_scale) {
  std::vector<bool> kept = odometry_edges(graph);
  const std::vector<OdometryPose> poses = odometry_chains(graph, kept, noise_scale);
  std::map<std::pair<RobotId, RobotId>, Pcm> pairs;
  std::map<ClosureId, std::size_t> edge_of;
  for (std::size_t k = 0; k < kept.size(); ++k) {
    if (kept[k]) continue;
    const BlockEdge& e = graph.edges[k];
    const RelativePose measured = relative_pose(graph, e, noise_scale);
    if (!edge_of.emplace(closure_id(measured.from, measured.to), k).second) continue;
    const auto [a, b] = std::minmax({measured.from.robot, measured.to.robot});
    Pcm& pcm = pairs.try_emplace({a, b}, a, b, config).first->second;
    (void)pcm.add({poses[static_cast<std::size_t>(e.i)], poses[static_cast<std::size_t>(e.j)],
                   measured.T_from_to, measured.covariance, 0, 0.0});
  }
  for (const auto& [pair, pcm] : pairs)
    for (const ClosureId& id : pcm.inliers()) kept[edge_of.at(id)] = true;
  return kept;
}

}  // namespace km
