#include "modules/vio/residuals/pose_block.hpp"

#include <algorithm>

namespace km {

PoseBlock pose_block(const SE3& T_odom_body) {
  const Eigen::Quaterniond q(T_odom_body.linear());
  const auto& t = T_odom_body.translation();
  return {q.x(), q.y(), q.z(), q.w(), t.x(), t.y(), t.z()};
}

MotionBlock motion_block(const OdometryState& state) {
  MotionBlock block;
  Eigen::Map<Eigen::Matrix<double, 9, 1>> map(block.data());
  map << state.v_odom, state.gyro_bias, state.accel_bias;
  return block;
}

SE3 pose_of(const double* pose_block) {
  const Eigen::Map<const Eigen::Quaterniond> q(pose_block);
  return make_pose(q.normalized().toRotationMatrix(),
                   Eigen::Map<const Eigen::Vector3d>(pose_block + 4));
}

OdometryState state_of(const double* pose_block, const double* motion_block) {
  OdometryState state;
  state.T_odom_body = pose_of(pose_block);
  state.v_odom = Eigen::Map<const Eigen::Vector3d>(motion_block);
  state.gyro_bias = Eigen::Map<const Eigen::Vector3d>(motion_block + 3);
  state.accel_bias = Eigen::Map<const Eigen::Vector3d>(motion_block + 6);
  return state;
}

bool PoseManifold::Plus(const double* x, const double* delta, double* x_plus_delta) const {
  const PoseBlock block = pose_block(retract(pose_of(x), Eigen::Map<const Vector6>(delta)));
  std::copy(block.begin(), block.end(), x_plus_delta);
  return true;
}

bool PoseManifold::PlusJacobian(const double* /*x*/, double* jacobian) const {
  Eigen::Map<Eigen::Matrix<double, 7, 6, Eigen::RowMajor>>(jacobian).setIdentity();
  return true;
}

bool PoseManifold::Minus(const double* y, const double* x, double* y_minus_x) const {
  Eigen::Map<Vector6>{y_minus_x} = local_coordinates(pose_of(x), pose_of(y));
  return true;
}

bool PoseManifold::MinusJacobian(const double* /*x*/, double* jacobian) const {
  Eigen::Map<Eigen::Matrix<double, 6, 7, Eigen::RowMajor>>(jacobian).setIdentity();
  return true;
}

}  // namespace km
