#pragma once

#include "modules/core/camera/camera.hpp"
#include "modules/core/data/odometry.hpp"
#include "modules/core/geometry/geometry.hpp"

namespace km {

// Covariances of poses are 6x6, in the tangent space at the pose: T = T_mean * exp(xi),
// xi = [rotation; translation] ~ N(0, Sigma) [rad, m]. First order, as in Mangelson et al.,
// "Characterizing the Uncertainty of Jointly Distributed Poses in the Lie Algebra", TRO 2020,
// for independent poses.

/// A rigid transform with its covariance.
struct UncertainPose {
  SE3 T = SE3::Identity();
  Matrix6 Sigma = Matrix6::Zero();
};

/// The same transform without noise.
[[nodiscard]] UncertainPose exact(const UncertainPose& T_a_b);

/// T_a_b * T_b_c of independent factors: Sigma_ac = Ad(T_b_c^-1) Sigma_ab Ad(T_b_c^-1)^T +
/// Sigma_bc.
[[nodiscard]] UncertainPose compose(const UncertainPose& T_a_b, const UncertainPose& T_b_c);

/// T_b_a with Sigma_ba = Ad(T_a_b) Sigma_ab Ad(T_a_b)^T.
[[nodiscard]] UncertainPose inverse(const UncertainPose& T_a_b);

/// T_b_c between two poses of one chain from a, with c after b. Its covariance is the part that was
/// added between b and c, Sigma_bc = Sigma_ac - Ad(T_c_b) Sigma_ab Ad(T_c_b)^T. It is the exact
/// inverse of compose(). Negative eigenvalues from rounding are set to zero.
[[nodiscard]] UncertainPose between_on_chain(const UncertainPose& T_a_b,
                                             const UncertainPose& T_a_c);

/// Covariance of [position; rotation about fixed axes] along the axes of frame a, as in
/// geometry_msgs/PoseWithCovariance.
[[nodiscard]] Matrix6 along_fixed_axes(const UncertainPose& T_a_b);
/// Inverse of along_fixed_axes(): covariance of the pose T_a_b.
[[nodiscard]] Matrix6 from_fixed_axes(const SE3& T_a_b, const Matrix6& fixed);

/// Covariance of the errors in T_a_b by the calibration of the cameras that measured it: they scale
/// distances and angles.
[[nodiscard]] Matrix6 calibration_covariance(const SE3& T_a_b, DepthSource depth);

/// The pose T_a_b with the covariance of a wrong scale added: all distances from a are wrong by one
/// factor, whose standard deviation is `scale_sigma`. So the position p errs by this share of p:
/// scale_sigma^2 p p^T is added to its covariance.
[[nodiscard]] UncertainPose with_scale_error(UncertainPose T_a_b, double scale_sigma);

/// True if every element is finite, the matrix symmetric to 1e-6 of its largest element, and no
/// eigenvalue below -1e-9 of the largest. For untrusted matrices.
[[nodiscard]] bool is_covariance(const Matrix6& Sigma);

/// True if odometry can continue from a state with this covariance: symmetric, variances from 1e-16
/// to 1e6, and no eigenvalue of the correlations below 1e-9. For untrusted matrices.
[[nodiscard]] bool is_usable(const StateCovariance& Sigma);

}  // namespace km
