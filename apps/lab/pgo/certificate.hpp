#pragma once

#include "modules/rbcd/quadratic_problem.hpp"

namespace km {

/// Returns S = Q - Lambda, 4n x 4n. Lambda is block-diagonal with sym(Y_i^T (X Q)_Y,i) on the
/// rotations of pose i and 0 on its translation (Rosen et al., "SE-Sync", IJRR 2019, before the
/// translations are eliminated). At a critical point X S = 0, and if S is positive semidefinite
/// there, X is a global minimum of the relaxation at every rank.
///
/// With vertical priors the vertical z is a variable too, a unit vector. This loses no generality,
/// because a common rotation does not change the cost. w ||Y_i up_i - z||^2 is then a quadratic
/// form in [X z], and S is 4(n + 1) x 4(n + 1). z is the third column of a last block whose other
/// rows and columns are zero. The multiplier of its length is z^T sum w (z - Y_i up_i). At a
/// critical point [X 0 0 z 0] S = 0. Precondition: `problem` has no public edges.
[[nodiscard]] Eigen::SparseMatrix<double> certificate_matrix(const QuadraticProblem& problem,
                                                             const LiftedPoses& X);

/// Bounds on the optimality of a point, proven up to the rounding of a factorisation.
struct [[nodiscard]] Certificate {
  bool certified = false;  ///< The cost is within 1e-4 of the relaxation's minimum.
  /// Upper bound of (cost - minimum of the relaxation) / cost.
  double relative_gap = 0.0;
  /// No eigenvalue of S is smaller once the translations are eliminated.
  double lambda_bound = 0.0;
};

/// Bounds the cost of all feasible points of any rank from below, and thus the gap of feasible `X`.
/// With the translations eliminated, every feasible Z has the trace 3n (1 more with a vertical). If
/// S + shift on the rotations is positive semidefinite, then
///     tr(Q Z) = tr(Lambda) + tr(S Z) >= tr(Lambda) - shift 3n ,
/// and tr(Lambda) is the cost. The bound is at least 0. S is computed at the best translations for
/// the rotations of `X` and, with priors, at the best tilt of `X`.
///
/// A sparse Cholesky factorisation that succeeds shows that S + shift is semidefinite (the test of
/// Rosen, "Accelerating Certifiable Estimation with Preconditioned Eigensolvers", RA-L 2022). One
/// translation is held, because S does not depend on the position of the origin.
///
/// The shifts 1e-8 of the cost over 3n and then half of 1e-4 of the cost over 3n are tried. If
/// neither certifies `X`, larger shifts show which gap can be proven. Precondition: `problem` has
/// no public edges and is connected.
[[nodiscard]] Certificate certify(const QuadraticProblem& problem, const LiftedPoses& X);

}  // namespace km
