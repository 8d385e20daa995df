#pragma once

#include <algorithm>
#include <cstdint>

#include "modules/rbcd/quadratic_problem.hpp"

namespace km {

/// When minimise() stops.
struct TruncatedNewtonOptions {
  int max_iterations = 3;            ///< Accepted steps.
  int max_cg_iterations = 50;        ///< Hessian products per step.
  double cg_tolerance = 0.1;         ///< Residual of the Newton system over its right-hand side.
  double gradient_tolerance = 1e-6;  ///< Riemannian gradient norm at convergence.
};

struct [[nodiscard]] TruncatedNewtonResult {
  LiftedPoses X;  ///< Feasible; the start if no step was accepted.
  double initial_cost = 0.0;
  double cost = 0.0;                   ///< At X; never above initial_cost.
  double initial_gradient_norm = 0.0;  ///< Riemannian.
  double gradient_norm = 0.0;
  int iterations = 0;
  int cg_iterations = 0;
  double radius = 0.0;     ///< Final trust-region radius.
  bool converged = false;  ///< By a tolerance, or no step decreases the cost beyond rounding.
};

/// Minimises `problem` from feasible `X` by the Riemannian trust-region method with preconditioned
/// truncated conjugate gradients (Absil, Baker, Gallivan, "Trust-Region Methods on Riemannian
/// Manifolds", FoCM 2007, Alg. 1 and 2). The radius is measured in the norm of the preconditioner.
[[nodiscard]] TruncatedNewtonResult minimise(const QuadraticProblem& problem, LiftedPoses X,
                                             const TruncatedNewtonOptions& options);

/// Runs minimise() and then goes beyond the minimum by `relaxation` - 1 times the step from `X` to
/// it, if the cost there is below the cost at `X`. For the exact minimum of a quadratic this holds
/// for every relaxation in (0, 2). This is successive over-relaxation, with which sweeps over
/// blocks reduce their slow modes in a fraction of the rounds (Ostrowski; Young, "Iterative
/// Solution of Large Linear Systems", 1971, Ch. 4). At most 1: plain minimise().
[[nodiscard]] TruncatedNewtonResult minimise_over_relaxed(const QuadraticProblem& problem,
                                                          const LiftedPoses& X,
                                                          const TruncatedNewtonOptions& options,
                                                          double relaxation);

/// Relaxation of the block updates after round `round`, for minimise_over_relaxed(): grows from 1.5
/// to `max`. The first rounds damp the fast modes, later ones speed up the slow modes.
[[nodiscard]] inline double relaxation_after(std::uint32_t round, double max) {
  return std::min(max, 2.0 - 4.0 / (8.0 + round));
}

}  // namespace km
