#pragma once

#include "modules/core/geometry/geometry.hpp"

namespace km {

// Conventions of the style guide: tangent vectors are [rotation; translation], perturbations act on
// the right, T * exp(xi). Formulas: Forster et al., "On-Manifold Preintegration for Real-Time
// Visual-Inertial Odometry", TRO 2017, Sec. III-A; Barfoot, "State Estimation for Robotics", Ch. 7.

/// Cross-product matrix: skew(a) * b = a x b.
Eigen::Matrix3d skew(const Eigen::Vector3d& a);

/// Rotation of the rotation vector `phi` [rad]. Exact also near zero.
Eigen::Matrix3d so3_exp(const Eigen::Vector3d& phi);

/// Rotation vector of `R`, of length at most pi [rad].
Eigen::Vector3d so3_log(const Eigen::Matrix3d& R);

/// Right Jacobian of SO(3): exp(phi + d) = exp(phi) * exp(J_r(phi) * d) to first order.
Eigen::Matrix3d so3_right_jacobian(const Eigen::Vector3d& phi);

/// Inverse of so3_right_jacobian(), for |phi| < 2 pi.
Eigen::Matrix3d so3_right_jacobian_inverse(const Eigen::Vector3d& phi);

/// Exponential of the twist `xi` = [rotation; translation].
SE3 se3_exp(const Vector6& xi);

/// Twist of `T`, inverse of se3_exp().
Vector6 se3_log(const SE3& T);

/// Adjoint: T * exp(xi) = exp(adjoint(T) * xi) * T.
Matrix6 adjoint(const SE3& T);

/// The pose that estimators reach from `T` by the step `delta` = [rotation; translation]: R' = R
/// exp(rotation), normalised to a rotation, and t' = t + R translation. It equals T * exp(delta) to
/// first order (Forster et al., Sec. III-C, Eq. (21)).
SE3 retract(const SE3& T, const Eigen::Ref<const Vector6>& delta);

/// Inverse of retract(): the delta from `from` to `to`.
Vector6 local_coordinates(const SE3& from, const SE3& to);

/// The shortest rotation that maps the direction of `up` to z.
Eigen::Matrix3d rotation_to_z(const Eigen::Vector3d& up);

/// The rotation nearest to `M` in the Frobenius norm (projection by SVD).
Eigen::Matrix3d nearest_rotation(const Eigen::Matrix3d& M);

/// The matrix with orthonormal columns nearest to `M` (r x 3) in the Frobenius norm: U V^T of its
/// SVD. It is a point of the Stiefel manifold St(3, r).
Eigen::MatrixXd nearest_stiefel(const Eigen::MatrixXd& M);

}  // namespace km
