#pragma once

#include <Eigen/Core>
#include <random>
#include <span>
#include <vector>

#include "modules/core/geometry/geometry.hpp"

namespace km {

/// n poses in the rank relaxation of SE-Sync (Rosen et al., IJRR 2019, Sec. 4), an r x 4n matrix.
/// Its columns 4i to 4i+3 are [Y_i p_i], Y_i in St(3, r) (orthonormal columns), p_i in R^r [m].
/// With r = 3 it holds ordinary poses [R_i t_i] (or mirrored ones). Tangent vectors and gradients
/// have the same shape. A point of (St(3, r) x R^r)^n is called feasible below.
using LiftedPoses = Eigen::MatrixXd;

/// Number of poses of `X`.
inline Eigen::Index pose_count(const LiftedPoses& X) {
  return X.cols() / 4;
}

/// Largest entry of |Y_i^T Y_i - I| over the poses: 0 if X is feasible.
[[nodiscard]] double stiefel_error(const LiftedPoses& X);

/// The feasible poses nearest to nearly feasible ones, with stiefel_error(X) at most 0.1. The
/// result equals that of nearest_stiefel() for each pose up to rounding, at a fraction of its time.
/// Equal inputs give equal bits.
[[nodiscard]] LiftedPoses restore_stiefel(LiftedPoses X);

/// Orthogonal projection of `V` onto the tangent space at feasible `X`: V_i - Y_i sym(Y_i^T V_i) on
/// the rotations, the identity on the translations.
[[nodiscard]] LiftedPoses project_tangent(const LiftedPoses& X, const LiftedPoses& V);

/// The point reached from `X` along tangent `V` by the polar retraction,
/// (Y_i + V_i) (I + V_i^T V_i)^(-1/2), of second order; translations are added.
[[nodiscard]] LiftedPoses retract(const LiftedPoses& X, const LiftedPoses& V);

/// `X` moved along a random tangent vector with entries of standard deviation `sigma` on the
/// rotations. The gradient at lifted rigid poses has no components in the added dimensions. A
/// descent uses these dimensions only if it starts at perturbed poses.
[[nodiscard]] LiftedPoses perturb_rotations(const LiftedPoses& X, double sigma, std::mt19937& rng);

/// The matrix of St(3, r) by which every robot lifts its frame: the first three unit vectors. Equal
/// on all robots without an exchange. Precondition: rank >= 3.
[[nodiscard]] Eigen::MatrixXd lifting_matrix(Eigen::Index rank);

/// Lifts the pose `T` = [R t]: returns [Y R, Y t + p] (r x 4). `L` = [Y p] (r x 4) is the transform
/// from the frame of `T` to the lifted frame.
[[nodiscard]] Eigen::MatrixXd lift(const Eigen::MatrixXd& L, const SE3& T);

/// The transform [lifting_matrix(rank) 0], for lift().
[[nodiscard]] Eigen::MatrixXd lifted_identity(Eigen::Index rank);

/// Poses lifted to rank r by lifted_identity(r).
[[nodiscard]] LiftedPoses lift(std::span<const SE3> poses, Eigen::Index rank);

/// Rigid poses from lifted poses, in the frame of the lifted pose `anchor` = [Y p] (r x 4): R_i =
/// the rotation nearest to Y^T Y_i, t_i = Y^T (p_i - p). Every robot rounds its own block with the
/// same anchor, so that all blocks are in one frame (Tian et al., TRO 2021, Sec. III, rounding).
/// Exact if X is a lifted set of rigid poses.
[[nodiscard]] std::vector<SE3> round_to_poses(const LiftedPoses& X, const Eigen::MatrixXd& anchor);

}  // namespace km
