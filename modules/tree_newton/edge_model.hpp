#pragma once

#include "modules/core/geometry/geometry.hpp"
#include "modules/core/geometry/precision.hpp"
#include "modules/tree_newton/vertical_prior.hpp"

namespace km {

/// The kind of second derivatives.
enum class Curvature {
  kGaussNewton,  ///< Linearised residuals: never indefinite, zero along rigid motions.
  kFull,         ///< The Riemannian Hessian.
};

/// Cost of one measured relative pose (R, t), to second order in the tangent vectors xi = [w; v] of
/// its poses:
///     f = kappa ||R_j - R_i R||_F^2 + tau ||t_j - t_i - R_i t||^2
/// Poses move as R exp(w), t + R v, along geodesics of SO(3) x R^3, so that the second derivatives
/// are those of the Riemannian Hessian. The model depends only on T_i^-1 T_j. A rigid motion of the
/// whole team does not change it, and a smooth deformation hardly does.
struct EdgeModel {
  double cost = 0.0;
  Vector6 g_i;
  Vector6 g_j;
  Matrix6 H_ii;
  Matrix6 H_ij;
  Matrix6 H_jj;
};

/// `measured` is T_i_j.
[[nodiscard]] EdgeModel model_edge(const SE3& measured, const Precision& precision, const SE3& T_i,
                                   const SE3& T_j, Curvature curvature);

/// Sets cost and gradient of `model` and does not touch its second derivatives.
void set_cost_and_gradient(const SE3& measured, const Precision& precision, const SE3& T_i,
                           const SE3& T_j, EdgeModel& model);

/// Cost of a vertical prior, to second order in the tangent vector w of the rotation of its pose.
struct VerticalModel {
  double cost = 0.0;
  Eigen::Vector3d g;
  Eigen::Matrix3d H;
};

[[nodiscard]] VerticalModel model_vertical(const VerticalPrior& prior, const Eigen::Matrix3d& R,
                                           Curvature curvature);

}  // namespace km
