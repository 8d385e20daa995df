#include "modules/vio/image_pose.hpp"

#include "modules/core/lie.hpp"

namespace km {

ImagePose ImagePose::at(const OdometryState& state, const Eigen::Vector3d& gyro, double shift_s) {
  ImagePose image;
  const Eigen::Vector3d rate = gyro - state.gyro_bias;
  const Eigen::Matrix3d turn = so3_exp(shift_s * rate);
  const Eigen::Matrix3d R = state.T_odom_body.linear() * turn;
  image.T_odom_body = make_pose(R, state.T_odom_body.translation() + shift_s * state.v_odom);
  image.by_state = turn.transpose();
  image.by_calibration << rate, Eigen::Matrix<double, 3, 6>::Identity(),
      R.transpose() * state.v_odom, Eigen::Matrix<double, 3, 6>::Zero();
  image.by_calibration.bottomRightCorner<3, 3>().setIdentity();
  return image;
}

}  // namespace km
