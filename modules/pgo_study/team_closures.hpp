#pragma once

#include <cstddef>
#include <vector>

#include "modules/core/pose_graph.hpp"
#include "modules/pgo_study/team_graph.hpp"

namespace km {

/// Edges of a team's graph as robots hand them to each other: robot k has id k, and its keyframes
/// are its poses, from 0.
struct TeamClosure {
  std::size_t edge = 0;  ///< Its place in TeamGraph::edges.
  Closure closure;       ///< With the odometry of both ends.
};

/// The odometry steps of each robot, [k][i] being robot k's step from keyframe i to i + 1. Throws
/// std::invalid_argument if a robot's odometry is interrupted.
[[nodiscard]] std::vector<std::vector<RelativePose>> team_odometry(const TeamGraph& graph,
                                                                   double noise_scale = 1.0);

/// All edges that are no step of a robot's own odometry, in the order of the edges. Odometry
/// between two robots, where the graph has any, is among them. Sigmas of all edges are taken to be
/// `noise_scale` times those of the graph. Throws as team_odometry() does.
[[nodiscard]] std::vector<TeamClosure> team_closures(const TeamGraph& graph,
                                                     double noise_scale = 1.0);

}  // namespace km
