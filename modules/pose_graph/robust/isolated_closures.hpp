#pragma once

#include <vector>

#include "modules/pose_graph/team/team_graph.hpp"

namespace km {

/// Which closures stand alone: no other one between the same two robots, a few poses away at both
/// ends, agrees with them along the odometry between. Robots that meet do so for a while, while a
/// false closure rarely has another false one beside it that agrees, so that what is left without
/// the isolated ones is nearly true. `odometry` marks the steps of odometry; residuals are compared
/// with `barc` [sigma], allowing for the noise of both closures and of the steps between.
[[nodiscard]] std::vector<bool> isolated_closures(const TeamGraph& graph,
                                                  const std::vector<bool>& odometry, double barc);

}  // namespace km
