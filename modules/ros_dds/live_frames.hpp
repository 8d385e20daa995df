#pragma once

#include <deque>
#include <optional>
#include <vector>

#include "modules/core/odometry.hpp"
#include "modules/core/pose_graph.hpp"

namespace km {

/// The frames of a robot as REP 105 has them: `odom`, in which it moves without jumps, and `map`,
/// that of its team, in which odometry is corrected whenever the pose graph says so.
class LiveFrames {
 public:
  /// In order of time.
  void add(const OdometryState& state);
  /// Behind the state of its image.
  void add(const KeyframeOdometry& keyframe);
  /// The correction from here on: where the newest keyframe is that both know.
  void add(const Trajectory& trajectory);

  [[nodiscard]] const SE3& T_map_odom() const { return T_map_odom_; }

  /// Stamps of the keyframes, by index; those of a former life of the robot are 0.
  [[nodiscard]] const std::vector<Stamp>& keyframe_stamps() const { return stamps_; }

  /// Angular rate in the body frame over the last two states [rad/s]; zero before there are two.
  [[nodiscard]] const Eigen::Vector3d& angular_rate() const { return angular_rate_; }

 private:
  std::deque<OdometryState> recent_;
  std::vector<Stamp> stamps_;
  std::vector<std::optional<SE3>> T_odom_kf_;  // by odometry as it was live
  Eigen::Vector3d angular_rate_ = Eigen::Vector3d::Zero();
  SE3 T_map_odom_ = SE3::Identity();
};

}  // namespace km
