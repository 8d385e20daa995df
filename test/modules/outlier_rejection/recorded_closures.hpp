#pragma once

#include <algorithm>
#include <filesystem>
#include <map>
#include <utility>
#include <vector>

#include "modules/outlier_rejection/pcm.hpp"
#include "modules/pose_graph/recorded_graph.hpp"

namespace km {

/// Every closure in the given files of one team, in the order in which robots that drive at the
/// same pace would meet them.
inline std::vector<Closure> recorded_closures(const std::vector<std::filesystem::path>& files) {
  std::map<RobotId, std::vector<OdometryPose>> poses;
  std::vector<RelativePose> edges;
  for (const auto& file : files) {
    const RecordedGraph graph = read_recorded_graph(file);
    poses[graph.robot] = odometry_poses(graph);
    edges.insert(edges.end(), graph.intra_closures.begin(), graph.intra_closures.end());
    for (const RelativePose& edge : graph.inter_closures)
      if (edge.from.robot == graph.robot) edges.push_back(edge);  // the other robot has it too
  }
  const auto known_at = [](const RelativePose& e) { return std::max(e.from.index, e.to.index); };
  std::stable_sort(edges.begin(), edges.end(), [&](const RelativePose& x, const RelativePose& y) {
    return known_at(x) < known_at(y);
  });
  std::vector<Closure> closures;
  for (const RelativePose& e : edges)
    closures.push_back({poses.at(e.from.robot).at(e.from.index),
                        poses.at(e.to.robot).at(e.to.index), e.T_from_to, e.covariance, 0, 0.0});
  return closures;
}

using RobotPair = std::pair<RobotId, RobotId>;

inline RobotPair pair_of(const Closure& closure) {
  return std::minmax(closure.from.id.robot, closure.to.id.robot);
}

/// One Pcm per robot pair, given the closures in turn.
inline std::map<RobotPair, Pcm> reject_outliers(const std::vector<Closure>& closures,
                                                const PcmConfig& config) {
  std::map<RobotPair, Pcm> pcms;
  for (const Closure& closure : closures) {
    const RobotPair pair = pair_of(closure);
    (void)pcms.try_emplace(pair, pair.first, pair.second, config).first->second.add(closure);
  }
  return pcms;
}

}  // namespace km
