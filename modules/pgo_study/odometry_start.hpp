#pragma once

#include <vector>

#include "modules/core/geometry.hpp"
#include "modules/pgo_study/team_graph.hpp"

namespace km {

/// Where robots begin that know nothing but their odometry: each robot's poses chained along it
/// (where it is interrupted, along closures inside the robot), and the robots placed one beside the
/// other by the vote of the closures between them, best connected first, as robots enter a common
/// frame (see align_frames()). Edges from the last pose of a robot to the first of the next are
/// odometry that was cut, and decide alone. False closures bend nothing here. Throws
/// std::invalid_argument if a robot's own edges do not reach all its poses.
[[nodiscard]] std::vector<SE3> odometry_start(const TeamGraph& graph);

}  // namespace km
