#include "modules/tree_newton/edge_model.hpp"

#include "modules/core/geometry/lie.hpp"

namespace km {
namespace {

// Axis vector of the skew-symmetric part of M.
Eigen::Vector3d axis_of(const Eigen::Matrix3d& M) {
  return 0.5 * Eigen::Vector3d(M(2, 1) - M(1, 2), M(0, 2) - M(2, 0), M(1, 0) - M(0, 1));
}

Eigen::Matrix3d symmetric(const Eigen::Matrix3d& M) {
  return 0.5 * (M + M.transpose());
}

// With Z = R_i^T R_j, M = Z R^T, N = R^T Z and u = R_i^T (t_j - t_i) - t the cost is 2 kappa (3 -
// tr M) + tau |u|^2. For the tangent vectors [w; v], tr M and u become tr(exp(-[w_i]) Z exp([w_j])
// R^T) and u + Z v_j - v_i - (exp([w_i]) - I) t.
struct Relative {
  Eigen::Matrix3d Z;
  Eigen::Matrix3d M;
  Eigen::Matrix3d N;
  Eigen::Vector3d u;
};

Relative relative(const SE3& measured, const SE3& T_i, const SE3& T_j) {
  Relative r;
  r.Z.noalias() = T_i.linear().transpose() * T_j.linear();
  r.M.noalias() = r.Z * measured.linear().transpose();
  r.N.noalias() = measured.linear().transpose() * r.Z;
  r.u = T_i.linear().transpose() * (T_j.translation() - T_i.translation()) - measured.translation();
  return r;
}

void set_slope(const SE3& measured, const Precision& precision, const SE3& T_i, const SE3& T_j,
               const Relative& r, EdgeModel& model) {
  // Computed from residuals, not from 3 - tr M, to avoid cancellation if they are small.
  model.cost = precision.kappa * (T_j.linear() - T_i.linear() * measured.linear()).squaredNorm() +
               precision.tau * r.u.squaredNorm();
  model.g_i.head<3>() = -4.0 * precision.kappa * axis_of(r.M) +
                        2.0 * precision.tau * r.u.cross(measured.translation());
  model.g_i.tail<3>() = -2.0 * precision.tau * r.u;
  model.g_j.head<3>() = 4.0 * precision.kappa * axis_of(r.N);
  model.g_j.tail<3>() = 2.0 * precision.tau * (r.Z.transpose() * r.u);
}

}  // namespace

void set_cost_and_gradient(const SE3& measured, const Precision& precision, const SE3& T_i,
                           const SE3& T_j, EdgeModel& model) {
  set_slope(measured, precision, T_i, T_j, relative(measured, T_i, T_j), model);
}

EdgeModel model_edge(const SE3& measured, const Precision& precision, const SE3& T_i,
                     const SE3& T_j, Curvature curvature) {
  const Relative r = relative(measured, T_i, T_j);
  EdgeModel model;
  set_slope(measured, precision, T_i, T_j, r, model);
  const Eigen::Matrix3d I = Eigen::Matrix3d::Identity();
  const Eigen::Vector3d t = measured.translation();
  // du = S w_i - v_i + Z v_j. Gauss-Newton uses the residual in the moving frame of pose i, in
  // which a rigid motion of both poses leaves it unchanged.
  const Eigen::Matrix3d S = skew(curvature == Curvature::kFull ? t : Eigen::Vector3d(t + r.u));
  model.H_ii.setZero();
  model.H_ij.setZero();
  model.H_jj.setZero();
  if (curvature == Curvature::kGaussNewton) {
    model.H_ii.topLeftCorner<3, 3>() = 4.0 * precision.kappa * I;
    model.H_jj.topLeftCorner<3, 3>() = 4.0 * precision.kappa * I;
    model.H_ij.topLeftCorner<3, 3>() = -4.0 * precision.kappa * r.Z;
  } else {
    const double trace = r.M.trace();
    model.H_ii.topLeftCorner<3, 3>() =
        2.0 * precision.kappa * (trace * I - symmetric(r.M)) +
        2.0 * precision.tau * (r.u.dot(t) * I - symmetric(r.u * t.transpose()));
    model.H_jj.topLeftCorner<3, 3>() = 2.0 * precision.kappa * (trace * I - symmetric(r.N));
    model.H_ij.topLeftCorner<3, 3>() = 2.0 * precision.kappa * (r.M - trace * I) * r.Z;
  }
  const double two_tau = 2.0 * precision.tau;
  model.H_ii.topLeftCorner<3, 3>() += two_tau * S.transpose() * S;
  model.H_ii.topRightCorner<3, 3>() = -two_tau * S.transpose();
  model.H_ii.bottomLeftCorner<3, 3>() = -two_tau * S;
  model.H_ii.bottomRightCorner<3, 3>() = two_tau * I;
  model.H_ij.topRightCorner<3, 3>() = two_tau * S.transpose() * r.Z;
  model.H_ij.bottomRightCorner<3, 3>() = -two_tau * r.Z;
  model.H_jj.bottomRightCorner<3, 3>() = two_tau * I;
  return model;
}

VerticalModel model_vertical(const VerticalPrior& prior, const Eigen::Matrix3d& R,
                             Curvature curvature) {
  const Eigen::Vector3d& u = prior.up;
  const Eigen::Vector3d z = R.row(2).transpose();  // the vertical in the frame of the pose
  VerticalModel model;
  model.cost = prior.weight * (u - z).squaredNorm();
  model.g = 2.0 * prior.weight * z.cross(u);
  const Eigen::Matrix3d I = Eigen::Matrix3d::Identity();
  if (curvature == Curvature::kGaussNewton)  // a common rotation about the vertical costs nothing
    model.H = 2.0 * prior.weight * (I - z * z.transpose());
  else
    model.H = prior.weight * (2.0 * u.dot(z) * I - u * z.transpose() - z * u.transpose());
  return model;
}

}  // namespace km
