#include "modules/vio/motion_model.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "modules/core/geometry/lie.hpp"

namespace km {
namespace {

// Standard deviation of the accelerometer bias at the start [m/s^2], and its random walk
// [m/s^3/sqrt(Hz)]: far below any acceleration that images show.
constexpr double kHeldAccel = 1e-4;

// Share of VioConfig::loss_scale without an inertial sensor. Nothing else corrects a few bad
// tracks.
constexpr double kLossShare = 1.0 / 3.0;

// R_body_cam from the axes of a camera (x right, y down, z forward) to those of a body (x forward,
// y left, z up) that looks the same way.
Eigen::Matrix3d body_axes_of_camera() {
  Eigen::Matrix3d R_body_cam;
  R_body_cam << 0.0, 0.0, 1.0,  //
      -1.0, 0.0, 0.0,           //
      0.0, -1.0, 0.0;
  return R_body_cam;
}

}  // namespace

MotionModel motion_model(const SensorRig& rig, const VioConfig& config) {
  MotionModel model;
  model.config = checked(config);
  if (rig.has_imu) return model;
  model.is_measured = false;
  model.longest_pause_s = MotionModel::kNever_s;
  model.longest_coast_s = 1.0;
  model.vision_patience_s = 0.0;
  model.gyro_bias_sigma_radps = 3.0;
  model.max_gyro_bias_radps = std::numeric_limits<double>::infinity();
  model.least_error_ratio = 1.0;
  VioConfig& adapted = model.config;
  adapted.gravity_mps2 = 0.0;
  adapted.calibrate = false;
  adapted.loss_scale *= kLossShare;
  adapted.tilt_sigma = 0.0;
  adapted.accel_bias_sigma = kHeldAccel;
  adapted.gyro_noise_factor = adapted.accel_noise_factor = 1.0;
  adapted.max_imu_gap_s = MotionModel::kNever_s;
  adapted.start_s = 0.0;
  return model;
}

ImuNoise virtual_imu_noise(const MotionNoise& motion, double dt_s) {
  return {.gyro_noise_density = motion.turn * dt_s / std::numbers::sqrt3,
          .gyro_random_walk = motion.turn,
          .accel_noise_density = motion.accel,
          .accel_random_walk = kHeldAccel};
}

void ShownMotion::add(const OdometryState& former, const OdometryState& newest, double dt_s) {
  const double over_s = 3.0 * seconds_between(former.stamp, newest.stamp);
  seconds_ += dt_s;
  const double share = dt_s / std::min(seconds_, kTimeConstant_s);
  accel_ += share * ((newest.v_odom - former.v_odom).squaredNorm() / over_s - accel_);
  turn_ += share * ((newest.gyro_bias - former.gyro_bias).squaredNorm() / over_s - turn_);
}

MotionNoise ShownMotion::noise(const MotionNoise& most) const {
  if (seconds_ == 0.0) return most;
  return {.accel = std::min(kCaution * std::sqrt(accel_), most.accel),
          .turn = std::min(kCaution * std::sqrt(turn_), most.turn)};
}

std::vector<ImuSample> virtual_samples(Stamp from, Stamp to) {
  return {{.stamp = from}, {.stamp = to}};
}

OdometryState moved_by_images(const OdometryState& before, const TrackedFrame& tracked,
                              const SE3& T_body_left) {
  const SE3 motion = T_body_left * *tracked.T_previous_current * T_body_left.inverse();
  const double dt_s = seconds_between(before.stamp, tracked.stamp);
  OdometryState now = before;
  now.stamp = tracked.stamp;
  now.T_odom_body = before.T_odom_body * motion;
  now.T_odom_body.linear() = nearest_rotation(now.T_odom_body.linear());
  now.v_odom = before.T_odom_body.linear() * motion.translation() / dt_s;
  now.gyro_bias = -so3_log(motion.linear()) / dt_s;
  return now;
}

Eigen::Matrix3d level_with_camera(const SE3& T_body_left) {
  return body_axes_of_camera() * T_body_left.linear().transpose();
}

}  // namespace km
