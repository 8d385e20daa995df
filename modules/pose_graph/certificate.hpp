#pragma once

#include "modules/pose_graph/quadratic_problem.hpp"

namespace km {

/// S = Q - Lambda, 4n x 4n: Lambda is block-diagonal with sym(Y_i^T (X Q)_Y,i) on the rotations of
/// pose i and 0 on its translation (Rosen et al., "SE-Sync", IJRR 2019, before the
/// translations are eliminated). At a critical point X S = 0, and if S is positive semidefinite
/// there, X is a global minimum of the relaxation at every rank.
/// Precondition: `problem` has no public edges.
[[nodiscard]] Eigen::SparseMatrix<double> certificate_matrix(const QuadraticProblem& problem,
                                                             const LiftedPoses& X);

/// What is known of the optimality of a point.
struct [[nodiscard]] Certificate {
  bool certified = false;     ///< The cost is within `relative_gap` of the relaxation's minimum.
  double lambda_min = 0.0;    ///< Smallest eigenvalue of S with the translations eliminated.
  double relative_gap = 0.0;  ///< Bound: max(0, -lambda_min) tr(Y^T Y) over the cost.
  /// Direction of the smallest eigenvalue, 4n, its translations the best ones for its rotations.
  Eigen::VectorXd direction = {};
};

/// Certifies the minimum of `problem` at feasible `X`, of dimension 3 (2: planar, lifted).
///
/// With translations eliminated, tr(Q Z) >= cost(X) + lambda_min tr(Z) for every feasible Z of the
/// relaxation, whose trace is 3n: the cost lies within -3n lambda_min of the minimum. Certified
/// means that this is below 1e-5 of the cost, which is decided by a sparse Cholesky factorisation
/// of S, shifted on the rotations (as in Rosen, "Accelerating Certifiable Estimation with
/// Preconditioned Eigensolvers", RA-L 2022); one translation is held, since S does not depend on
/// where the origin lies. lambda_min then comes from Lanczos iterations on the inverse.
/// Precondition: `problem` has no public edges and is connected.
[[nodiscard]] Certificate certify(const QuadraticProblem& problem, const LiftedPoses& X);

/// Feasible poses of rank r + 1 with a lower cost than `X` of rank r, on the way along the negative
/// direction into the added dimension (Riemannian staircase of SE-Sync, step out of a
/// saddle point); rank of `problem` is r + 1. `X` with a row of zeros if there is no decrease.
[[nodiscard]] LiftedPoses escape(const QuadraticProblem& problem, const LiftedPoses& X,
                                 const Eigen::VectorXd& direction);

}  // namespace km
