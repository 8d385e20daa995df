#pragma once

#include <deque>
#include <optional>

#include "modules/core/frame.hpp"
#include "modules/recordings/ros_messages.hpp"

namespace km {

/// Interpolates the poses of an odometry at the stamps of frames.
class PoseStream {
 public:
  /// Longest step over which poses are interpolated.
  static constexpr double kLongestStep_s = 1.0;

  /// Stamps must ascend.
  void add(Stamp stamp, const MeasuredPose& pose);

  /// starts_by(): a pose at or before the stamp has been added. reaches(): a pose at or after the
  /// stamp has been added.
  [[nodiscard]] bool starts_by(Stamp stamp) const { return first_ && *first_ <= stamp; }
  [[nodiscard]] bool reaches(Stamp stamp) const {
    return !poses_.empty() && poses_.back().stamp >= stamp;
  }

  /// The pose at an instant, interpolated at constant velocity, with an interpolated covariance.
  /// nullopt if the neighbouring poses are more than kLongestStep_s apart, or one is missing.
  /// Stamps ascend from call to call.
  [[nodiscard]] std::optional<MeasuredPose> at(Stamp stamp);

 private:
  struct Entry {
    Stamp stamp;
    MeasuredPose pose;
  };
  std::deque<Entry> poses_;
  std::optional<Stamp> first_;  // first stamp of the stream
};

/// The pose of the body from the pose of a frame `child` on the body. The covariance is that of
/// geometry_msgs/PoseWithCovariance: x, y, z and rotations about x, y, z, along the axes of odom;
/// [m^2], [rad^2].
[[nodiscard]] MeasuredPose measured_pose(const SE3& T_odom_child, const Matrix6& covariance,
                                         const SE3& T_child_body);

/// The pose of the body from a message of ROS; nullopt if its numbers are no pose. An invalid or
/// unknown (-1 first) covariance becomes zero.
[[nodiscard]] std::optional<MeasuredPose> measured_pose(const RosOdometry& message,
                                                        const SE3& T_child_body);

}  // namespace km
