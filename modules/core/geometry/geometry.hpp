#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <numbers>

namespace km {

/// Rigid transform. `T_a_b` maps coordinates in frame b to frame a: p_a = T_a_b * p_b.
/// It is also the pose of frame b expressed in frame a. Chains read inside out:
/// T_a_c = T_a_b * T_b_c.
using SE3 = Eigen::Isometry3d;

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

/// Degrees in a radian, for texts and tables for people.
inline constexpr double kDegrees = 180.0 / std::numbers::pi;

/// Rotation angle of `R`, in [0, pi] [rad].
inline double angle_of(const Eigen::Matrix3d& R) {
  return Eigen::AngleAxisd(R).angle();
}

/// True if `T` is finite, its rotation R does not mirror, and no entry of R^T R differs from the
/// identity's by more than `tolerance`.
inline bool is_rigid(const SE3& T, double tolerance) {
  const Eigen::Matrix3d R = T.linear();
  return T.matrix().allFinite() && R.determinant() > 0.0 &&
         (R.transpose() * R - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() <= tolerance;
}

/// The transform with rotation `R` and translation `t`.
inline SE3 make_pose(const Eigen::Matrix3d& R, const Eigen::Vector3d& t) {
  SE3 T = SE3::Identity();
  T.linear() = R;
  T.translation() = t;
  return T;
}

}  // namespace km
