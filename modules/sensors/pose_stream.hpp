#pragma once

#include <deque>
#include <optional>

#include "modules/core/frame.hpp"
#include "modules/recordings/ros_messages.hpp"

namespace km {

/// Poses of an odometry on their way into packets: those at the stamps of frames are interpolated.
class PoseStream {
 public:
  /// Between poses further apart nothing is interpolated.
  static constexpr double kLongestStep_s = 1.0;

  /// Later than the one before.
  void add(Stamp stamp, const MeasuredPose& pose);

  /// There were poses at or before the stamp, and there are at or after it.
  [[nodiscard]] bool starts_by(Stamp stamp) const { return first_ && *first_ <= stamp; }
  [[nodiscard]] bool reaches(Stamp stamp) const {
    return !poses_.empty() && poses_.back().stamp >= stamp;
  }

  /// The pose at an instant: on the way from the one before to the one after at constant velocity,
  /// with a covariance between theirs. nullopt where the two are too far apart, or one is missing.
  /// Stamps ascend from call to call.
  [[nodiscard]] std::optional<MeasuredPose> at(Stamp stamp);

 private:
  struct Entry {
    Stamp stamp;
    MeasuredPose pose;
  };
  std::deque<Entry> poses_;
  std::optional<Stamp> first_;  // of all that came
};

/// The pose of the body, by that of a frame `child` on it with a covariance as ROS has it
/// (geometry_msgs/PoseWithCovariance: x, y, z and rotations about x, y, z, along the axes of odom;
/// [m^2], [rad^2]).
[[nodiscard]] MeasuredPose measured_pose(const SE3& T_odom_child, const Matrix6& covariance,
                                         const SE3& T_child_body);

/// The same of a message of ROS; nullopt if its numbers are no pose. A covariance that is none, or
/// unknown (-1 first), is zero.
[[nodiscard]] std::optional<MeasuredPose> measured_pose(const RosOdometry& message,
                                                        const SE3& T_child_body);

}  // namespace km
