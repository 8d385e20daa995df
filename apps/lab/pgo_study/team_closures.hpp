#pragma once

#include <cstddef>
#include <vector>

#include "apps/lab/pgo_study/team_graph.hpp"
#include "modules/core/pose_graph.hpp"

namespace km {

/// An edge of a team's graph as a closure between robots. Robot k has id k, and its keyframes are
/// its poses, numbered from 0.
struct TeamClosure {
  std::size_t edge = 0;  ///< Index in TeamGraph::edges.
  Closure closure;       ///< Closure with the odometry of both ends.
};

/// The steps of odometry of each robot; [k][i] is robot k's step from keyframe i to i + 1. Throws
/// std::invalid_argument if a robot's odometry is interrupted.
[[nodiscard]] std::vector<std::vector<RelativePose>> team_odometry(const TeamGraph& graph,
                                                                   double noise_scale = 1.0);

/// All edges that are no step of a robot's own odometry, in the order of the edges. Odometry
/// between two robots is included. The sigmas of all edges are `noise_scale` times those of the
/// graph. Throws as team_odometry() does.
[[nodiscard]] std::vector<TeamClosure> team_closures(const TeamGraph& graph,
                                                     double noise_scale = 1.0);

}  // namespace km
