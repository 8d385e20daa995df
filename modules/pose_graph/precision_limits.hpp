#pragma once

#include "modules/pose_graph/session_graph.hpp"

namespace km {

/// Limits the weights of the edges of a robot by the mean weights of a step of all members
/// (SessionGraph::step_precision). No robot measures closures much more precisely than the team
/// measures a step of odometry. A robot that claims to would overrule all others. Closures to other
/// robots weigh at most four times as much as a step of the lower median robot. The own edges of
/// the robot are scaled together, so that its mean step weighs at most 1.25 times as much. With
/// fewer than three members nothing is limited, because with two robots it is unknown which one
/// claims too much. All members know the same steps and compute the same limits.
void limit_precisions(SessionGraph& graph);

}  // namespace km
