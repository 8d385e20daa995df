#pragma once

#include "modules/pose_graph/session_graph.hpp"

namespace km {

/// Limits the weights of a robot's edges by the mean weights of a step of all members
/// (SessionGraph::step_precision): no robot measures much better than the team moves, and one that
/// claims to would overrule all others. Closures to others weigh at most four times what a step of
/// the lower median robot does. The robot's own edges are scaled together, so that its mean step
/// weighs at most 1.25 times as much. With fewer than three members nothing is limited: nobody can
/// say which of two is usual. All members know the same steps and limit alike.
void limit_precisions(SessionGraph& graph);

}  // namespace km
