#pragma once

#include "modules/pose_graph/pose_graph_config.hpp"
#include "modules/pose_graph/session_part.hpp"

namespace km {

/// Creates the solver for the method of a session, with the parameters of `config`.
[[nodiscard]] MemberSolverFactory solver_choice(const PoseGraphConfig& config);

}  // namespace km
