#pragma once

#include "modules/pose_graph/pose_graph_config.hpp"
#include "modules/pose_graph/session_part.hpp"
#include "modules/pose_graph/tree_root.hpp"
#include "modules/rbcd/member_rbcd.hpp"

namespace km {

/// Parameters of Newton's method in a session without a limit of rounds.
[[nodiscard]] TreeNewtonOptions newton_options(const PoseGraphConfig& config);

/// Creates the solver for the method of a session, with the parameters of `config`. `dimension` 2:
/// poses and measurements are planar (Newton's method only).
[[nodiscard]] MemberSolverFactory solver_choice(const PoseGraphConfig& config, int dimension = 3);

}  // namespace km
