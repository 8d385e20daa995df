#pragma once

#include <vector>

#include "modules/pose_graph/session_graph.hpp"
#include "modules/pose_graph/tree_root.hpp"

namespace km {

/// Poses that one robot computes alone.
struct [[nodiscard]] LoneSolution {
  std::vector<SE3> poses;  ///< The last accepted ones; the start if no step was accepted.
  bool converged =
      false;  ///< False: the rounds did not suffice, or the equations have no solution.
};

/// Solves `graph` by TreeNewton as a session of one member. `graph` has no closures to members. New
/// second derivatives are computed earlier than by default, because they cost no bytes. Throws
/// std::invalid_argument as TreeNewton does.
LoneSolution solve_alone(SessionGraph graph, TreeNewtonOptions options);

}  // namespace km
