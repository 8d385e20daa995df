#pragma once

#include <deque>
#include <optional>
#include <vector>

#include "modules/core/data/covariance.hpp"
#include "modules/core/data/odometry.hpp"
#include "modules/core/data/pose_graph.hpp"

namespace km {

/// Frames of a robot according to REP 105. The robot moves without jumps in `odom`. `map` is the
/// frame of its team, and the pose graph corrects the pose of `odom` in it.
class LiveFrames {
 public:
  /// States have to be in order of time.
  void add(const OdometryState& state);
  /// Adds a keyframe. Precondition: the state of the same image has been added.
  void add(const KeyframeOdometry& keyframe);
  /// Updates the correction from the newest keyframe that both odometry and `trajectory` contain.
  void add(const Trajectory& trajectory);

  [[nodiscard]] const SE3& T_map_odom() const { return T_map_odom_; }

  /// The pose of the body in `map`. Its covariance is that of the newest keyframe: the covariance
  /// of the last optimised keyframe plus that of the steps of odometry after it. The error of the
  /// map's scale is added (Trajectory::scale_sigma).
  [[nodiscard]] UncertainPose T_map_body(const SE3& T_odom_body) const;

  /// Stamps of the keyframes by index; 0 for keyframes that have not been added.
  [[nodiscard]] const std::vector<Stamp>& keyframe_stamps() const { return stamps_; }

  /// Angular rate in the body frame over the last two states [rad/s]; zero before there are two.
  [[nodiscard]] const Eigen::Vector3d& angular_rate() const { return angular_rate_; }

 private:
  std::deque<OdometryState> recent_;
  std::vector<Stamp> stamps_;
  std::vector<std::optional<SE3>> T_odom_kf_;    // poses from live odometry
  std::vector<UncertainPose> steps_;             // T_previous_kf of each keyframe
  Matrix6 newest_covariance_ = Matrix6::Zero();  // covariance of the newest keyframe
  double scale_sigma_ = 0.0;
  Eigen::Vector3d angular_rate_ = Eigen::Vector3d::Zero();
  SE3 T_map_odom_ = SE3::Identity();
};

}  // namespace km
