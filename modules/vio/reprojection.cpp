#include "modules/vio/reprojection.hpp"

#include <cmath>

namespace km {

ViewModel view_model(const PinholeCamera& camera, double noise_px) {
  const SE3 T_cam_body = camera.T_body_cam.inverse();
  return {T_cam_body.linear(), T_cam_body.translation(),
          std::sqrt(camera.fx * camera.fy) / noise_px};
}

bool reprojection_error(const ViewModel& view, const Eigen::Vector2d& bearing,
                        const SE3& T_odom_body, const Eigen::Vector3d& p_odom, Eigen::Vector2d& r) {
  const Eigen::Vector3d p_body =
      T_odom_body.linear().transpose() * (p_odom - T_odom_body.translation());
  const Eigen::Vector3d p_cam = view.R_cam_body * p_body + view.t_cam_body;
  if (!(p_cam.z() > kMinDepth_m)) return false;
  r = view.weight * (p_cam.head<2>() / p_cam.z() - bearing);
  return true;
}

bool linearize_reprojection(const ViewModel& view, const Eigen::Vector2d& bearing,
                            const SE3& T_odom_body, const SE3& T_linearization,
                            const Eigen::Vector3d& p_odom, ReprojectionTerm& term) {
  if (!reprojection_error(view, bearing, T_odom_body, p_odom, term.r)) return false;
  const Eigen::Matrix3d R_body_odom = T_linearization.linear().transpose();
  const Eigen::Vector3d p_body = R_body_odom * (p_odom - T_linearization.translation());
  const Eigen::Vector3d p_cam = view.R_cam_body * p_body + view.t_cam_body;
  if (!(p_cam.z() > kMinDepth_m)) return false;

  const double f = view.weight / p_cam.z();
  Eigen::Matrix<double, 2, 3> J_cam;
  J_cam << f, 0.0, -f * p_cam.x() / p_cam.z(), 0.0, f, -f * p_cam.y() / p_cam.z();
  const Eigen::Matrix<double, 2, 3> J_body = J_cam * view.R_cam_body;
  // p_body of T retracted by [phi; rho]: exp(-phi) p_body - rho to first order.
  for (int row = 0; row < 2; ++row) {
    const Eigen::Vector3d J = J_body.row(row);
    term.J_pose.row(row).head<3>() = J.cross(p_body);
    term.J_pose.row(row).tail<3>() = -J;
  }
  term.J_point.noalias() = J_body * R_body_odom;
  return true;
}

}  // namespace km
