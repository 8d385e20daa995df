#pragma once

#include "modules/core/camera.hpp"
#include "modules/core/geometry.hpp"

namespace km {

/// A camera of the rig as the residuals need it.
struct ViewModel {
  Eigen::Matrix3d R_cam_body = Eigen::Matrix3d::Identity();
  Eigen::Vector3d t_cam_body = Eigen::Vector3d::Zero();
  double weight = 1.0;  ///< Focal length over pixel noise: bearing errors to standard deviations.
};

[[nodiscard]] ViewModel view_model(const PinholeCamera& camera, double noise_px);

/// A linearised reprojection error in standard deviations. The pose's tangent is [rotation;
/// translation], see retract().
struct ReprojectionTerm {
  Eigen::Vector2d r;
  Eigen::Matrix<double, 2, 6> J_pose;
  Eigen::Matrix<double, 2, 3> J_point;
};

/// Landmarks nearer than this in front of a camera have no residual [m].
inline constexpr double kMinDepth_m = 0.05;

/// weight * (pi(T_cam_body T_odom_body^-1 p_odom) - bearing) with pi(p) = [x/z, y/z]; false if the
/// landmark is not in front of the camera.
[[nodiscard]] bool reprojection_error(const ViewModel& view, const Eigen::Vector2d& bearing,
                                      const SE3& T_odom_body, const Eigen::Vector3d& p_odom,
                                      Eigen::Vector2d& r);

/// The same with derivatives. They are taken at `T_linearization` while r is that of T_odom_body:
/// first-estimate Jacobians (Huang, Mourikis, Roumeliotis, ISER 2008) if a prior holds this pose,
/// else pass T_odom_body twice.
[[nodiscard]] bool linearize_reprojection(const ViewModel& view, const Eigen::Vector2d& bearing,
                                          const SE3& T_odom_body, const SE3& T_linearization,
                                          const Eigen::Vector3d& p_odom, ReprojectionTerm& term);

}  // namespace km
