#include "modules/vio/residuals.hpp"

#include <Eigen/Cholesky>
#include <cmath>

#include "modules/core/geometry/lie.hpp"

namespace km {
namespace {

using Vector9 = Eigen::Matrix<double, 9, 1>;

// Standard deviations of undetected changes at rest. The detector notices a motion when the image
// has moved by a pixel or two. At a distance of a few metres a pixel is 2 mrad.
constexpr double kRestRotation_rad = 4e-3;
constexpr double kRestSpeed_mps = 0.02;
constexpr double kRestPosition_m = 0.01;

}  // namespace

ViewModel view_model(const Camera& camera, double noise_px) {
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
  // First order for T retracted by [phi; rho]: exp(-phi) p_body - rho.
  for (int row = 0; row < 2; ++row) {
    const Eigen::Vector3d J = J_body.row(row);
    term.J_pose.row(row).head<3>() = J.cross(p_body);
    term.J_pose.row(row).tail<3>() = -J;
  }
  term.J_point.noalias() = J_body * R_body_odom;
  return true;
}

OdometryState FirstEstimate::applied_to(const OdometryState& state) const {
  OdometryState result = state;
  if (pose) result.T_odom_body = *pose;
  if (motion) {
    result.v_odom = motion->v_odom;
    result.gyro_bias = motion->gyro_bias;
    result.accel_bias = motion->accel_bias;
  }
  return result;
}

std::optional<ImuFactor> ImuFactor::of(const ImuPreintegration& imu, double gravity_mps2) {
  const Eigen::LLT<Matrix9> llt(imu.covariance());
  const ImuNoise& noise = imu.noise();
  if (!(imu.dt_s() > 0.0) || llt.info() != Eigen::Success || !(noise.gyro_random_walk > 0.0) ||
      !(noise.accel_random_walk > 0.0))
    return std::nullopt;
  const Matrix9 sqrt_information = llt.matrixL().solve(Matrix9::Identity());
  if (!sqrt_information.allFinite()) return std::nullopt;
  return ImuFactor(imu, gravity_mps2, sqrt_information, imu.dt_s());
}

ImuFactor ImuFactor::at_rest(const ImuNoise& noise, double dt_s) {
  // At rest both states have the same pose and velocity. Without samples and with dt = 0, the
  // residuals of Eq. (45) of Forster et al. are the differences of the two states.
  const ImuPreintegration none(noise, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero());
  Vector9 weight;
  weight << Eigen::Vector3d::Constant(1.0 / kRestRotation_rad),
      Eigen::Vector3d::Constant(1.0 / kRestSpeed_mps),
      Eigen::Vector3d::Constant(1.0 / kRestPosition_m);
  return {none, 0.0, weight.asDiagonal(), dt_s};
}

ImuFactor::ImuFactor(const ImuPreintegration& imu, double gravity_mps2,
                     const Matrix9& sqrt_information, double walk_s)
    : imu_(imu), gravity_odom_(0.0, 0.0, -gravity_mps2), sqrt_information_(sqrt_information) {
  const double sqrt_dt = std::sqrt(walk_s);
  gyro_walk_weight_ = 1.0 / (imu.noise().gyro_random_walk * sqrt_dt);
  accel_walk_weight_ = 1.0 / (imu.noise().accel_random_walk * sqrt_dt);
}

Vector15 ImuFactor::error(const OdometryState& i, const OdometryState& j) const {
  const PreintegratedMotion d = imu_.corrected(i.gyro_bias, i.accel_bias);
  const double dt = imu_.dt_s();
  const Eigen::Matrix3d R_i_T = i.T_odom_body.linear().transpose();
  Vector15 r;
  r.segment<3>(0) = so3_log(d.dR.transpose() * R_i_T * j.T_odom_body.linear());
  r.segment<3>(3) = R_i_T * (j.v_odom - i.v_odom - gravity_odom_ * dt) - d.dv;
  r.segment<3>(6) = R_i_T * (j.T_odom_body.translation() - i.T_odom_body.translation() -
                             i.v_odom * dt - 0.5 * dt * dt * gravity_odom_) -
                    d.dp;
  r.head<9>() = (sqrt_information_.triangularView<Eigen::Lower>() * r.head<9>()).eval();
  r.segment<3>(9) = gyro_walk_weight_ * (j.gyro_bias - i.gyro_bias);
  r.segment<3>(12) = accel_walk_weight_ * (j.accel_bias - i.accel_bias);
  return r;
}

ImuTerm ImuFactor::linearize(const OdometryState& i, const OdometryState& j,
                             const OdometryState& lin_i, const OdometryState& lin_j) const {
  ImuTerm term;
  term.r = error(i, j);
  const double dt = imu_.dt_s();
  const Eigen::Matrix3d R_i_T = lin_i.T_odom_body.linear().transpose();
  const Eigen::Matrix3d R_i_j = R_i_T * lin_j.T_odom_body.linear();
  const Eigen::Vector3d dbg = lin_i.gyro_bias - imu_.gyro_bias();
  const Eigen::Matrix3d dR = imu_.motion().dR * so3_exp(imu_.dR_dbg() * dbg);
  const Eigen::Vector3d r_rotation = so3_log(dR.transpose() * R_i_j);
  const Eigen::Matrix3d J_r_inverse = so3_right_jacobian_inverse(r_rotation);

  term.J_i.setZero();
  term.J_j.setZero();
  // Rotation.
  term.J_i.block<3, 3>(0, 0) = -J_r_inverse * R_i_j.transpose();
  term.J_i.block<3, 3>(0, 9) =
      -J_r_inverse * so3_exp(-r_rotation) * so3_right_jacobian(imu_.dR_dbg() * dbg) * imu_.dR_dbg();
  term.J_j.block<3, 3>(0, 0) = J_r_inverse;
  // Velocity.
  term.J_i.block<3, 3>(3, 0) = skew(R_i_T * (lin_j.v_odom - lin_i.v_odom - gravity_odom_ * dt));
  term.J_i.block<3, 3>(3, 6) = -R_i_T;
  term.J_i.block<3, 3>(3, 9) = -imu_.dv_dbg();
  term.J_i.block<3, 3>(3, 12) = -imu_.dv_dba();
  term.J_j.block<3, 3>(3, 6) = R_i_T;
  // Position.
  term.J_i.block<3, 3>(6, 0) =
      skew(R_i_T * (lin_j.T_odom_body.translation() - lin_i.T_odom_body.translation() -
                    lin_i.v_odom * dt - 0.5 * dt * dt * gravity_odom_));
  term.J_i.block<3, 3>(6, 3) = -Eigen::Matrix3d::Identity();
  term.J_i.block<3, 3>(6, 6) = -dt * R_i_T;
  term.J_i.block<3, 3>(6, 9) = -imu_.dp_dbg();
  term.J_i.block<3, 3>(6, 12) = -imu_.dp_dba();
  term.J_j.block<3, 3>(6, 3) = R_i_j;

  const auto L = sqrt_information_.triangularView<Eigen::Lower>();
  term.J_i.topRows<9>() = (L * term.J_i.topRows<9>()).eval();
  term.J_j.topRows<9>() = (L * term.J_j.topRows<9>()).eval();
  term.J_i.block<3, 3>(9, 9).diagonal().setConstant(-gyro_walk_weight_);
  term.J_j.block<3, 3>(9, 9).diagonal().setConstant(gyro_walk_weight_);
  term.J_i.block<3, 3>(12, 12).diagonal().setConstant(-accel_walk_weight_);
  term.J_j.block<3, 3>(12, 12).diagonal().setConstant(accel_walk_weight_);
  return term;
}

}  // namespace km
