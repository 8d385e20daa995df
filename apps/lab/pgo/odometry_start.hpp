#pragma once

#include <vector>

#include "apps/lab/pgo/team_graph.hpp"
#include "modules/core/geometry.hpp"

namespace km {

/// Start of robots that know only their odometry. The poses of each robot are chained along its
/// odometry; where that is interrupted, along closures inside the robot. Then the robots are placed
/// one after another, best connected first, by the vote of the closures between them. Robots enter
/// a common frame in the same way (see align_frames()). An edge from the last pose of a robot to
/// the first of the next is odometry that was cut, and decides alone. False closures do not distort
/// a robot's poses. Throws std::invalid_argument if a robot's own edges do not reach all its poses.
[[nodiscard]] std::vector<SE3> odometry_start(const TeamGraph& graph);

/// Moves each robot as a whole, as odometry_start() does; `poses` has one pose for each of the
/// graph. Throws std::invalid_argument if the graph does not join all robots.
[[nodiscard]] std::vector<SE3> placed_by_closures(const TeamGraph& graph, std::vector<SE3> poses);

}  // namespace km
