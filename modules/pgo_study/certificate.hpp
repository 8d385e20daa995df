#pragma once

#include <optional>

#include "modules/pose_graph/quadratic_problem.hpp"

namespace km {

/// S = Q - Lambda, 4n x 4n: Lambda is block-diagonal with sym(Y_i^T (X Q)_Y,i) on the rotations of
/// pose i and 0 on its translation (Rosen et al., "SE-Sync", IJRR 2019, before the
/// translations are eliminated). At a critical point X S = 0, and if S is positive semidefinite
/// there, X is a global minimum of the relaxation at every rank.
///
/// With vertical priors the vertical z is a variable, too, a unit vector: nothing is lost, since
/// the cost does not change when everything turns, and w ||Y_i up_i - z||^2 becomes a quadratic
/// form in [X z]. S is then 4(n + 1) x 4(n + 1): z is the third column of a last block whose other
/// rows and columns are zero, and the multiplier of its length is z^T sum w (z - Y_i up_i). At a
/// critical point [X 0 0 z 0] S = 0. Precondition: `problem` has no public edges.
[[nodiscard]] Eigen::SparseMatrix<double> certificate_matrix(const QuadraticProblem& problem,
                                                             const LiftedPoses& X);

/// What is known of the optimality of a point.
struct [[nodiscard]] Certificate {
  bool certified = false;  ///< Proven: the cost is within 1e-4 of the relaxation's minimum.
  /// Proven: the cost lies above the relaxation's minimum by at most this part.
  double relative_gap = 0.0;
  /// Not certified for what rounding could hide alone: no direction is known to lead down.
  bool hidden_by_rounding = false;
  /// Proven: tr(S Z) is at least this times tr(Z) on the columns of unit length, for all Z that
  /// cost no more. S has no smaller eigenvalue with the translations eliminated, but for rounding.
  double lambda_bound = 0.0;
  /// Estimate of the smallest eigenvalue, from above; of points that are not certified.
  std::optional<double> lambda_min = {};
  /// Its direction, 4n, the translations the best ones for its rotations; the vertical stays where
  /// it is. Empty if certified.
  Eigen::VectorXd direction = {};
};

/// Bounds from below what any feasible point of any rank can cost, and with it how far feasible `X`
/// lies above: with the translations eliminated, tr(Q Z) = tr(Lambda) + tr(S Z) >= tr(Lambda) -
/// shift 3n for every feasible Z, whose trace is 3n (and 1 more for the vertical), if S + shift on
/// the rotations is positive semidefinite; tr(Lambda) is the cost. Nothing costs less than 0. S is
/// taken at the best translations for the rotations of `X` and, with priors, at its best tilt.
///
/// That S + shift is semidefinite is proven by its sparse Cholesky factorisation (the test of
/// Rosen, "Accelerating Certifiable Estimation with Preconditioned Eigensolvers", RA-L 2022): as
/// the factors are those of a matrix next to it, the bound is lowered by what the difference can
/// come to, from the error analysis of Cholesky's method (Rump, "Verification of Positive
/// Definiteness", BIT 2006). Translations are as large as a point that costs no more than `X` can
/// have them. One of them is held, since S does not depend on where the origin lies.
///
/// A point is certified by a shift of 1e-8 of its cost over 3n, else of half of 1e-4. If neither
/// does it, larger shifts show what can be proven, and Lanczos iterations on the inverse estimate
/// the smallest eigenvalue. Precondition: `problem` has no public edges and is connected.
[[nodiscard]] Certificate certify(const QuadraticProblem& problem, const LiftedPoses& X);

/// Feasible poses of rank r + 1 with a lower cost than `X` of rank r, on the way along the negative
/// direction into the added dimension (Riemannian staircase of SE-Sync, step out of a
/// saddle point); rank of `problem` is r + 1. `X` with a row of zeros if there is no decrease.
[[nodiscard]] LiftedPoses escape(const QuadraticProblem& problem, const LiftedPoses& X,
                                 const Eigen::VectorXd& direction);

}  // namespace km
