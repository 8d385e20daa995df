#pragma once

#include <map>
#include <vector>

#include "modules/core/ids.hpp"
#include "modules/pose_graph/session_graph.hpp"
#include "modules/rbcd/quadratic_problem.hpp"

namespace km {

/// Edges between a robot and others, as public edges of its block. The poses at their other ends
/// are fixed.
struct BlockBorder {
  std::map<KeyframeId, Eigen::Index> fixed_of = {};  ///< Index of each fixed pose, from 0.
  std::vector<PublicEdge> edges = {};                ///< In the order of SessionGraph::between.
  std::vector<RobotId> robot_of_edge = {};           ///< By edge: the robot at the other end.
  std::vector<KeyframeIndex> own = {};               ///< The robot's own ends, ascending.
};

[[nodiscard]] BlockBorder border_of(const SessionGraph& part);

}  // namespace km
