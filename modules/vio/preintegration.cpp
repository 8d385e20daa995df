#include "modules/vio/preintegration.hpp"

#include <algorithm>

#include "modules/core/geometry/lie.hpp"

namespace km {
namespace {

ImuSample interpolate(const ImuSample& a, const ImuSample& b, Stamp stamp) {
  const double s = seconds_between(a.stamp, stamp) / seconds_between(a.stamp, b.stamp);
  return {stamp, (1.0 - s) * a.gyro + s * b.gyro, (1.0 - s) * a.accel + s * b.accel};
}

}  // namespace

ImuPreintegration::ImuPreintegration(const ImuNoise& noise, const Eigen::Vector3d& gyro_bias,
                                     const Eigen::Vector3d& accel_bias)
    : noise_(noise), gyro_bias_(gyro_bias), accel_bias_(accel_bias) {}

void ImuPreintegration::add(const ImuSample& begin, const ImuSample& end) {
  const double dt = seconds_between(begin.stamp, end.stamp);
  const Eigen::Vector3d turn = (0.5 * (begin.gyro + end.gyro) - gyro_bias_) * dt;
  const Eigen::Vector3d a = 0.5 * (begin.accel + end.accel) - accel_bias_;

  const Eigen::Matrix3d half = so3_exp(0.5 * turn);
  const Eigen::Matrix3d R_mid = motion_.dR * half;
  const Eigen::Vector3d dv = R_mid * a * dt;
  const Eigen::Matrix3d J_half = 0.5 * dt * so3_right_jacobian(0.5 * turn);
  const Eigen::Matrix3d J_full = dt * so3_right_jacobian(turn);
  const Eigen::Matrix3d full_T = (half * half).transpose();

  // Derivative of dv by the rotation error at the step's middle.
  const Eigen::Matrix3d dv_drot = -R_mid * skew(a) * dt;
  const Eigen::Matrix3d dv_drot_begin = dv_drot * half.transpose();
  const Eigen::Matrix3d dv_dgyro = dv_drot * J_half;
  const Eigen::Matrix3d dv_daccel = R_mid * dt;

  // Errors of [rotation; velocity; position]: x' = A x + B [gyro noise; accel noise].
  Matrix9 A = Matrix9::Identity();
  A.block<3, 3>(0, 0) = full_T;
  A.block<3, 3>(3, 0) = dv_drot_begin;
  A.block<3, 3>(6, 0) = 0.5 * dt * dv_drot_begin;
  A.block<3, 3>(6, 3).diagonal().setConstant(dt);
  Eigen::Matrix<double, 9, 6> B = Eigen::Matrix<double, 9, 6>::Zero();
  B.block<3, 3>(0, 0) = J_full;
  B.block<3, 3>(3, 0) = dv_dgyro;
  B.block<3, 3>(6, 0) = 0.5 * dt * dv_dgyro;
  B.block<3, 3>(3, 3) = dv_daccel;
  B.block<3, 3>(6, 3) = 0.5 * dt * dv_daccel;
  Vector6 variance;  // variance of noise that is constant over the step
  variance.head<3>().setConstant(noise_.gyro_noise_density * noise_.gyro_noise_density / dt);
  variance.tail<3>().setConstant(noise_.accel_noise_density * noise_.accel_noise_density / dt);
  covariance_ =
      (A * covariance_ * A.transpose() + B * variance.asDiagonal() * B.transpose()).eval();

  // A change of bias acts as the opposite change of every sample.
  const Eigen::Matrix3d dv_dbg_step = dv_drot_begin * dR_dbg_ - dv_dgyro;
  dp_dbg_ += dt * dv_dbg_ + 0.5 * dt * dv_dbg_step;
  dp_dba_ += dt * dv_dba_ - 0.5 * dt * dv_daccel;
  dv_dbg_ += dv_dbg_step;
  dv_dba_ -= dv_daccel;
  dR_dbg_ = (full_T * dR_dbg_ - J_full).eval();

  motion_.dp += dt * motion_.dv + 0.5 * dt * dv;
  motion_.dv += dv;
  motion_.dR = R_mid * half;
  dt_s_ += dt;
}

bool ImuPreintegration::add(std::span<const ImuSample> samples, Stamp from, Stamp to) {
  if (from > to || samples.empty() || samples.front().stamp > from || samples.back().stamp < to)
    return false;
  for (std::size_t k = 0; k + 1 < samples.size(); ++k) {
    const ImuSample& a = samples[k];
    const ImuSample& b = samples[k + 1];
    const Stamp begin = std::max(a.stamp, from);
    const Stamp end = std::min(b.stamp, to);
    if (begin >= end) continue;
    const ImuSample first = begin == a.stamp ? a : interpolate(a, b, begin);
    const ImuSample last = end == b.stamp ? b : interpolate(a, b, end);
    // A single step is split in two. Otherwise the noise would be constant over the whole time, and
    // the error of the position a multiple of that of the velocity: a covariance of rank 6.
    if (const Stamp middle = begin + (end - begin) / 2;
        begin == from && end == to && begin < middle) {
      const ImuSample half = interpolate(a, b, middle);
      add(first, half);
      add(half, last);
    } else {
      add(first, last);
    }
  }
  return true;
}

PreintegratedMotion ImuPreintegration::corrected(const Eigen::Vector3d& gyro_bias,
                                                 const Eigen::Vector3d& accel_bias) const {
  const Eigen::Vector3d dbg = gyro_bias - gyro_bias_;
  const Eigen::Vector3d dba = accel_bias - accel_bias_;
  return {motion_.dR * so3_exp(dR_dbg_ * dbg), motion_.dv + dv_dbg_ * dbg + dv_dba_ * dba,
          motion_.dp + dp_dbg_ * dbg + dp_dba_ * dba};
}

OdometryState predict(const OdometryState& state, const ImuPreintegration& imu,
                      double gravity_mps2) {
  const PreintegratedMotion d = imu.corrected(state.gyro_bias, state.accel_bias);
  const double dt = imu.dt_s();
  const Eigen::Vector3d g(0.0, 0.0, -gravity_mps2);
  const Eigen::Matrix3d R = state.T_odom_body.linear();
  OdometryState next = state;
  next.T_odom_body.linear() = Eigen::Quaterniond(R * d.dR).normalized().toRotationMatrix();
  next.T_odom_body.translation() += state.v_odom * dt + 0.5 * g * dt * dt + R * d.dp;
  next.v_odom += g * dt + R * d.dv;
  return next;
}

}  // namespace km
