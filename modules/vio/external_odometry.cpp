#include "modules/vio/external_odometry.hpp"

#include <algorithm>
#include <utility>

#include "modules/core/data/covariance.hpp"
#include "modules/vio/keyframe_rule.hpp"

namespace km {
namespace {

// A body that moves more slowly counts as at rest until it has moved farther than at these speeds
// in kRest_s.
constexpr double kLeastSpeed_mps = 0.01;
constexpr double kLeastRate_radps = 0.01;
constexpr double kRest_s = 1.0;

// Duration of `motion` at the least speed and rate above; the longer of the two.
double slowest_s(const SE3& motion) {
  return std::max(motion.translation().norm() / kLeastSpeed_mps,
                  angle_of(motion.linear()) / kLeastRate_radps);
}

}  // namespace

ExternalOdometry::ExternalOdometry(RobotId robot, DepthSource depth_source, const VioConfig& config)
    : robot_(robot), depth_source_(depth_source), config_(checked(config)) {}

void ExternalOdometry::continue_from(const VioCheckpoint& checkpoint) {
  last_keyframe_ = checkpoint.keyframe;
  continues_ = checkpoint.state.has_value();
  T_chain_odom_ = chain_of_next_run(checkpoint.keyframe);
  if (!continues_) return;
  last_ = last_kf_ = {checkpoint.keyframe.stamp, {checkpoint.state->T_odom_body}};
  T_chain_odom_ = checkpoint.keyframe.T_odom_kf * checkpoint.state->T_odom_body.inverse();
}

VioResult ExternalOdometry::process(const SensorPacket& packet) {
  VioResult result;
  if (packet.frame == nullptr || !packet.pose || !packet.pose->T_odom_body.matrix().allFinite())
    return result;
  const StampedMeasurement measured{packet.frame->stamp, *packet.pose};
  const bool is_taken_up =
      std::exchange(continues_, false) && measured.stamp == last_keyframe_->stamp;
  if (last_ && measured.stamp <= last_->stamp && !is_taken_up) return result;
  const bool has_jumped = !is_taken_up && is_jump(measured);
  if (has_jumped) {
    result.problem = VioProblem::kJumped;
    T_chain_odom_ = T_chain_odom_ * last_->pose.T_odom_body * measured.pose.T_odom_body.inverse();
  }
  if (last_ && !has_jumped && !is_taken_up)
    count_motion(measured);
  else
    T_odom_last_motion_ = measured.pose.T_odom_body;
  const SE3 T_odom_body = T_chain_odom_ * measured.pose.T_odom_body;
  OdometryState state;
  state.stamp = measured.stamp;
  state.T_odom_body = T_odom_body;
  if (last_ && !has_jumped && !is_taken_up)
    state.v_odom =
        (T_odom_body.translation() - (T_chain_odom_ * last_->pose.T_odom_body).translation()) /
        seconds_between(last_->stamp, measured.stamp);
  const bool locates_points =
      depth_source_ == DepthSource::kRightImage || packet.frame->depth != nullptr;
  const bool is_due =
      !last_kf_ || has_jumped ||
      is_keyframe_due(config_, moved_s_, last_keyframe_->T_odom_kf.inverse() * T_odom_body);
  // A keyframe without located points cannot be part of a closure and is useless. After a jump of
  // the external pose, a keyframe is made in any case: the uncertain step to it is then in the
  // graph.
  if (!is_taken_up && is_due && (locates_points || has_jumped))
    add_keyframe(measured, T_odom_body, has_jumped, result);
  if (!last_kf_) return result;
  if (is_taken_up)  // the state was published earlier; the covariance was not kept
    last_kf_ = measured;
  else
    result.states.push_back(state);
  result.frames.push_back({packet.frame, last_keyframe_->id.index, T_odom_body});
  last_ = measured;
  return result;
}

bool ExternalOdometry::is_jump(const StampedMeasurement& measured) const {
  if (!last_) return false;
  const double distance_m =
      (measured.pose.T_odom_body.translation() - last_->pose.T_odom_body.translation()).norm();
  return distance_m > config_.max_speed_mps * seconds_between(last_->stamp, measured.stamp);
}

// Adds the time in motion since the last measurement to moved_s_. A motion below the least speed
// and rate counts with the duration that it would have at them.
void ExternalOdometry::count_motion(const StampedMeasurement& measured) {
  const SE3& T_odom_body = measured.pose.T_odom_body;
  const double dt_s = seconds_between(last_->stamp, measured.stamp);
  const double away_s = slowest_s(T_odom_last_motion_.inverse() * T_odom_body);
  const bool is_fast = slowest_s(last_->pose.T_odom_body.inverse() * T_odom_body) > dt_s;
  if (!is_fast && away_s < kRest_s) return;
  moved_s_ += is_fast ? dt_s : away_s;
  T_odom_last_motion_ = T_odom_body;
}

// Covariance of the motion since the last keyframe.
Matrix6 ExternalOdometry::step_covariance(const StampedMeasurement& measured) const {
  if (!last_kf_)
    return unknown_step_covariance(measured.pose.T_odom_body.linear().transpose() *
                                   Eigen::Vector3d::UnitZ());
  const UncertainPose grown =
      between_on_chain({last_kf_->pose.T_odom_body, last_kf_->pose.covariance},
                       {measured.pose.T_odom_body, measured.pose.covariance});
  return keyframe_covariance(config_, moved_s_, grown.Sigma);
}

void ExternalOdometry::add_keyframe(const StampedMeasurement& measured, const SE3& T_odom_body,
                                    bool has_jumped, VioResult& result) {
  KeyframeOdometry keyframe;
  keyframe.id = {robot_, 0};
  keyframe.stamp = measured.stamp;
  keyframe.T_odom_kf = keyframe.T_previous_kf = T_odom_body;
  if (last_keyframe_) {
    keyframe.id.index = last_keyframe_->id.index + 1;
    keyframe.T_previous_kf = last_keyframe_->T_odom_kf.inverse() * T_odom_body;
    keyframe.covariance = has_jumped ? restart_covariance() : step_covariance(measured);
  }
  last_keyframe_ = keyframe;
  moved_s_ = 0.0;
  last_kf_ = measured;
  result.keyframes.push_back(keyframe);
}

}  // namespace km
