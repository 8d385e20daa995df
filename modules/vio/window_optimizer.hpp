#pragma once

#include "modules/vio/window.hpp"

namespace km {

struct WindowSolution {
  int iterations = 0;
  double initial_cost = 0.0;
  double final_cost = 0.0;
  bool usable = false;  ///< Finite, and no worse than at the start.
};

/// Minimises the window's cost over all states and landmarks by Levenberg-Marquardt steps with the
/// landmarks eliminated, in place: at most `max_iterations` solutions of the normal equations,
/// fewer once a step changes nothing. The derivatives of states in the prior are first estimates.
WindowSolution optimize(Window& window, int max_iterations);

/// The same cost minimised by Ceres until convergence, with derivatives at the current states.
/// For the start, where many steps from a rough guess are needed. `max_iterations` of the trust
/// region. Not usable: Ceres failed, the window is as it was.
WindowSolution optimize_by_ceres(Window& window, int max_iterations);

}  // namespace km
