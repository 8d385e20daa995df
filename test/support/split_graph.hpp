#pragma once

#include <algorithm>
#include <functional>
#include <map>
#include <vector>

#include "modules/core/odometry.hpp"
#include "modules/core/pose_graph.hpp"
#include "test/support/pose_graph_problems.hpp"

namespace km {

/// A pose graph split among robots. Every edge is given once.
struct SplitGraph {
  std::map<RobotId, std::uint32_t> keyframes;
  std::vector<RelativePose> odometry;        ///< Keyframe i to i + 1 of one robot, ascending.
  std::vector<RelativePose> closures;        ///< All other edges.
  std::map<RobotId, SE3> T_odom_first = {};  ///< Pose of keyframe 0; the identity if not given.
  std::map<RobotId, std::function<Vertical(std::uint32_t)>> up =
      {};  ///< Verticals at the keyframes of a robot.

  /// Poses of all robots as one block, robot by robot, ascending by id.
  [[nodiscard]] WholeGraph whole() const {
    std::map<RobotId, Eigen::Index> first;
    WholeGraph graph;
    for (const auto& [robot, count] : keyframes) {
      first[robot] = graph.poses;
      graph.poses += count;
    }
    for (const auto* edges : {&odometry, &closures})
      for (const RelativePose& e : *edges)
        graph.edges.push_back(block_edge(first.at(e.from.robot) + e.from.index,
                                         first.at(e.to.robot) + e.to.index, e));
    return graph;
  }
};

/// Splits a graph of one robot into `robots` contiguous blocks; robot k gets id ids[k].
inline SplitGraph split(const G2oGraph& graph, const std::vector<RobotId>& ids) {
  std::uint32_t poses = 0;
  for (const RelativePose& e : graph.edges)
    poses = std::max({poses, e.from.index + 1, e.to.index + 1});
  const auto robots = static_cast<std::uint32_t>(ids.size());
  const std::uint32_t size = poses / robots;
  const auto deal = [&](std::uint32_t index) {
    const std::uint32_t k = std::min(index / size, robots - 1);
    return KeyframeId{ids[k], index - k * size};
  };
  SplitGraph result;
  for (std::uint32_t k = 0; k < robots; ++k)
    result.keyframes[ids[k]] = k + 1 < robots ? size : poses - k * size;
  std::map<KeyframeId, RelativePose> odometry;
  for (RelativePose e : graph.edges) {
    e.from = deal(e.from.index);
    e.to = deal(e.to.index);
    const bool step = e.from.robot == e.to.robot && e.to.index == e.from.index + 1;
    if (!step || !odometry.try_emplace(e.from, e).second) result.closures.push_back(e);
  }
  for (const auto& [from, e] : odometry) result.odometry.push_back(e);
  return result;
}

inline InlierSet inlier_set(const SplitGraph& graph, RobotId a, RobotId b,
                            std::uint32_t version = 1) {
  InlierSet set{a, b, version, {}};
  for (const RelativePose& e : graph.closures)
    if (std::min(e.from.robot, e.to.robot) == a && std::max(e.from.robot, e.to.robot) == b)
      set.closures.push_back(closure_id(e.from, e.to));
  std::sort(set.closures.begin(), set.closures.end());
  return set;
}

inline KeyframeOdometry keyframe_odometry(const RelativePose& step) {
  KeyframeOdometry keyframe;
  keyframe.id = step.to;
  keyframe.T_previous_kf = step.T_from_to;
  keyframe.covariance = step.covariance;
  return keyframe;
}

inline Closure make_closure(const RelativePose& measured) {
  Closure closure;
  closure.from.id = measured.from;
  closure.to.id = measured.to;
  closure.T_from_to = measured.T_from_to;
  closure.covariance = measured.covariance;
  return closure;
}

/// Cost of the whole graph at the 3x4 or lifted poses that `pose` gives for keyframes.
template <typename PoseOf>
double cost_at(const SplitGraph& graph, const PoseOf& pose) {
  double cost = 0.0;
  for (const auto* edges : {&graph.odometry, &graph.closures})
    for (const RelativePose& e : *edges) {
      const Precision weight = precision_of(e.covariance);
      cost += edge_cost(pose(e.from), pose(e.to), e.T_from_to, weight.kappa, weight.tau);
    }
  return cost;
}

}  // namespace km
