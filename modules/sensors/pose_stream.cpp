#include "modules/sensors/pose_stream.hpp"

#include <cmath>

#include "modules/core/covariance.hpp"
#include "modules/core/lie.hpp"

namespace km {

void PoseStream::add(Stamp stamp, const MeasuredPose& pose) {
  if (!first_) first_ = stamp;
  poses_.push_back({stamp, pose});
}

std::optional<MeasuredPose> PoseStream::at(Stamp stamp) {
  while (poses_.size() > 1 && poses_[1].stamp <= stamp) poses_.pop_front();
  if (poses_.empty() || poses_.front().stamp > stamp) return std::nullopt;
  const auto& [before_ns, before] = poses_.front();
  if (before_ns == stamp) return before;
  if (poses_.size() < 2) return std::nullopt;
  const auto& [after_ns, after] = poses_[1];
  const double step_s = seconds_between(before_ns, after_ns);
  if (step_s > kLongestStep_s) return std::nullopt;
  const double share = seconds_between(before_ns, stamp) / step_s;
  const Vector6 motion = se3_log(before.T_odom_body.inverse() * after.T_odom_body);
  return MeasuredPose{before.T_odom_body * se3_exp(share * motion),
                      (1.0 - share) * before.covariance + share * after.covariance};
}

MeasuredPose measured_pose(const SE3& T_odom_child, const Matrix6& covariance,
                           const SE3& T_child_body) {
  const UncertainPose odom_child{T_odom_child, from_fixed_axes(T_odom_child, covariance)};
  const UncertainPose odom_body = compose(odom_child, {T_child_body, Matrix6::Zero()});
  return {odom_body.T, odom_body.Sigma};
}

std::optional<MeasuredPose> measured_pose(const RosOdometry& message, const SE3& T_child_body) {
  constexpr double kMaxNormError = 1e-3;
  const Eigen::Quaterniond& q = message.pose.orientation;
  if (!(std::abs(q.norm() - 1.0) < kMaxNormError) || !message.pose.position.allFinite())
    return std::nullopt;
  Matrix6 covariance = Eigen::Map<const Matrix6>(message.pose_covariance.data());
  if (!is_covariance(covariance)) covariance.setZero();
  return measured_pose(make_pose(q.normalized().toRotationMatrix(), message.pose.position),
                       covariance, T_child_body);
}

}  // namespace km
