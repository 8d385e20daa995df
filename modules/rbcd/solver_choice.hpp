#pragma once

#include "modules/rbcd/member_rbcd.hpp"
#include "modules/robust/tree_root.hpp"
#include "modules/session/pose_graph_config.hpp"
#include "modules/session/session_part.hpp"

namespace km {

/// Parameters of Newton's method in a session without a limit of rounds.
[[nodiscard]] TreeNewtonOptions newton_options(const PoseGraphConfig& config);

/// Creates the solver for the method of a session, with the parameters of `config`. `dimension` 2:
/// poses and measurements are planar (Newton's method only).
[[nodiscard]] MemberSolverFactory solver_choice(const PoseGraphConfig& config, int dimension = 3);

}  // namespace km
