#pragma once

#include <map>
#include <span>
#include <vector>

#include "modules/core/ids.hpp"
#include "modules/pose_graph/quadratic_problem.hpp"
#include "modules/pose_graph/session_graph.hpp"

namespace km {

/// A robot's own edges as those of a block of its poses.
[[nodiscard]] std::vector<BlockEdge> block_edges(std::span<const PoseEdge> own);

/// Edges between a robot and others as those of its block, with the poses at their other ends as
/// the fixed ones.
struct BlockBorder {
  std::map<KeyframeId, Eigen::Index> fixed_of = {};  ///< Numbered from 0.
  std::vector<PublicEdge> edges = {};                ///< As SessionGraph::between.
  std::vector<RobotId> robot_of_edge = {};           ///< At the other end.
  std::vector<KeyframeIndex> own = {};               ///< The robot's own ends, ascending.
};

[[nodiscard]] BlockBorder border_of(const SessionGraph& part);

}  // namespace km
