#include <algorithm>
#include <cmath>

#include "modules/vio/vio.hpp"

// Which keyframes Vio hands on, and with what relative pose.
namespace km {
namespace {

// The relative pose across a new start is hardly known: standard deviations [rad], [m].
constexpr double kRestartRotation = 0.3;
constexpr double kRestartTranslation = 1.0;

constexpr double kLeastTiltSigma = 1e-4;  // [rad]; no inertial sensor knows better

Matrix6 restart_covariance() {
  Vector6 sigma;
  sigma << Eigen::Vector3d::Constant(kRestartRotation),
      Eigen::Vector3d::Constant(kRestartTranslation);
  return sigma.cwiseAbs2().asDiagonal();
}

}  // namespace

// Live odometry refines the recent keyframes after they were handed on; the chain does not.
void Vio::locate(const OdometryState& state, const Frame& frame, VioResult& result) {
  if (const WindowFrame* keyframe = smoother_.frame_at(last_keyframe_->stamp))
    T_chain_odom_ = last_keyframe_->T_odom_kf * keyframe->state.T_odom_body.inverse();
  result.frames.push_back({frame, last_keyframe_->id.index, T_chain_odom_ * state.T_odom_body});
}

bool Vio::locates_points(const StereoFrame& frame) const {
  return rig_.stereo.depth_source == DepthSource::kRightImage || frame.depth != nullptr;
}

bool Vio::due(const OdometryState& state, const StereoFrame& frame) const {
  if (!locates_points(frame)) return false;  // no keyframe to close a loop with; a better one comes
  const double dt = seconds_between(last_keyframe_->stamp, state.stamp);
  if (dt < config_.output_interval_s - 1e-3) return false;
  if (dt >= config_.output_rest_interval_s) return true;
  const WindowFrame* previous = smoother_.frame_at(last_keyframe_->stamp);
  if (previous == nullptr) return true;
  const SE3 T = previous->state.T_odom_body.inverse() * state.T_odom_body;
  return T.translation().norm() >= config_.output_distance_m ||
         angle_of(T.linear()) >= config_.output_rotation_rad;
}

std::optional<Vertical> Vio::vertical_at(const OdometryState& state) const {
  if (config_.tilt_sigma < kLeastTiltSigma) return std::nullopt;
  return Vertical{state.T_odom_body.linear().transpose() * Eigen::Vector3d::UnitZ(),
                  config_.tilt_sigma * std::sqrt(config_.tilt_keyframes)};
}

void Vio::hand_on_first(const OdometryState& state, VioResult& result) {
  KeyframeOdometry keyframe;
  keyframe.stamp = state.stamp;
  keyframe.T_odom_kf = T_chain_odom_ * state.T_odom_body;
  keyframe.T_previous_kf = keyframe.T_odom_kf;
  keyframe.id = {robot_, 0};
  keyframe.vertical = vertical_at(state);
  if (last_keyframe_) {  // a new start
    keyframe.id.index = last_keyframe_->id.index + 1;
    keyframe.T_previous_kf = last_keyframe_->T_odom_kf.inverse() * keyframe.T_odom_kf;
    keyframe.covariance = restart_covariance();
  }
  last_keyframe_ = keyframe;
  result.keyframes.push_back(keyframe);
}

void Vio::hand_on(const OdometryState& state, VioResult& result) {
  const auto relative = smoother_.relative_pose(last_keyframe_->stamp, state.stamp);
  KeyframeOdometry keyframe;
  keyframe.id = {robot_, last_keyframe_->id.index + 1};
  keyframe.stamp = state.stamp;
  keyframe.vertical = vertical_at(state);
  keyframe.T_previous_kf =
      relative ? relative->T
               : last_keyframe_->T_odom_kf.inverse() * T_chain_odom_ * state.T_odom_body;
  keyframe.covariance = restart_covariance();
  if (relative) {
    const double dt = seconds_between(last_keyframe_->stamp, state.stamp);
    Vector6 drift;  // variance
    drift.head<3>().setConstant(dt * config_.drift_rotation * config_.drift_rotation);
    drift.tail<3>().setConstant(dt * config_.drift_translation * config_.drift_translation);
    keyframe.covariance = relative->Sigma;
    keyframe.covariance.diagonal() += drift;
  }
  keyframe.T_odom_kf = last_keyframe_->T_odom_kf * keyframe.T_previous_kf;
  last_keyframe_ = keyframe;
  result.keyframes.push_back(keyframe);
}

}  // namespace km
