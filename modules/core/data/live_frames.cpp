#include "modules/core/data/live_frames.hpp"

#include <algorithm>

#include "modules/core/geometry/lie.hpp"

namespace km {

void LiveFrames::add(const OdometryState& state) {
  constexpr std::size_t kRecent = 200;  // odometry publishes its first states together
  if (!recent_.empty()) {
    const OdometryState& before = recent_.back();
    const double dt = seconds_between(before.stamp, state.stamp);
    if (dt > 0.0)
      angular_rate_ =
          so3_log(before.T_odom_body.linear().transpose() * state.T_odom_body.linear()) / dt;
  }
  recent_.push_back(state);
  if (recent_.size() > kRecent) recent_.pop_front();
}

void LiveFrames::add(const KeyframeOdometry& keyframe) {
  const auto index = static_cast<std::size_t>(keyframe.id.index);
  stamps_.resize(std::max(stamps_.size(), index + 1));
  T_odom_kf_.resize(stamps_.size());
  steps_.resize(stamps_.size());
  steps_[index] = {keyframe.T_previous_kf, keyframe.covariance};
  if (index > 0 && index + 1 == steps_.size())
    newest_covariance_ = compose({SE3::Identity(), newest_covariance_}, steps_[index]).Sigma;
  stamps_[index] = keyframe.stamp;
  const auto state = std::ranges::find(recent_, keyframe.stamp, &OdometryState::stamp);
  if (state != recent_.end()) T_odom_kf_[index] = state->T_odom_body;
}

UncertainPose LiveFrames::T_map_body(const SE3& T_odom_body) const {
  UncertainPose T_kf_body;
  if (!T_odom_kf_.empty() && T_odom_kf_.back())
    T_kf_body.T = T_odom_kf_.back()->inverse() * T_odom_body;
  return with_scale_error(
      {T_map_odom_ * T_odom_body, compose({SE3::Identity(), newest_covariance_}, T_kf_body).Sigma},
      scale_sigma_);
}

void LiveFrames::add(const Trajectory& trajectory) {
  scale_sigma_ = trajectory.scale_sigma;
  if (const auto solved = std::min(trajectory.covariances.size(), steps_.size()); solved > 0) {
    UncertainPose newest{SE3::Identity(), trajectory.covariances[solved - 1]};
    for (std::size_t k = solved; k < steps_.size(); ++k) newest = compose(newest, steps_[k]);
    newest_covariance_ = newest.Sigma;
  }
  for (std::size_t k = std::min(T_odom_kf_.size(), trajectory.T_world_kf.size()); k-- > 0;) {
    if (!T_odom_kf_[k]) continue;
    T_map_odom_ = trajectory.T_world_kf[k] * T_odom_kf_[k]->inverse();
    return;
  }
}

}  // namespace km
