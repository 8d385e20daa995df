#pragma once

#include "modules/vio/window.hpp"

namespace km {

struct WindowSolution {
  int iterations = 0;
  double initial_cost = 0.0;
  double final_cost = 0.0;
  bool usable = false;  ///< Finite, and no worse than at the start.
};

/// Minimises the window's cost over all states and landmarks, in place: at most `max_iterations`
/// trust-region steps of Ceres with the landmarks eliminated (DENSE_SCHUR), fewer on convergence.
/// Derivatives by what the prior holds are first estimates. Not usable: Ceres failed, and the
/// window is as it was.
WindowSolution optimize_by_ceres(Window& window, int max_iterations);

/// The same minimum by Levenberg-Marquardt steps on WindowEquations, without building a problem
/// object of thousands of blocks for every image.
WindowSolution optimize(Window& window, int max_iterations);

}  // namespace km
