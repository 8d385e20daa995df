#pragma once

#include <algorithm>
#include <map>
#include <vector>

#include "modules/core/data/odometry.hpp"
#include "modules/core/data/pose_graph.hpp"

namespace km {

/// A pose graph split among robots. Every edge is given once.
struct SplitGraph {
  std::map<RobotId, std::uint32_t> keyframes;
  std::vector<RelativePose> odometry;  ///< Keyframe i to i + 1 of one robot, ascending.
  std::vector<RelativePose> closures;  ///< All other edges.
};

inline InlierSet inlier_set(const SplitGraph& graph, RobotId a, RobotId b) {
  InlierSet set{a, b, 1, {}};
  for (const RelativePose& e : graph.closures)
    if (std::min(e.from.robot, e.to.robot) == a && std::max(e.from.robot, e.to.robot) == b)
      set.closures.push_back(closure_id(e.from, e.to));
  std::sort(set.closures.begin(), set.closures.end());
  return set;
}

inline KeyframeOdometry keyframe_odometry(const RelativePose& step) {
  KeyframeOdometry keyframe{
      .id = step.to, .T_previous_kf = step.T_from_to, .covariance = step.covariance};
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

}  // namespace km
