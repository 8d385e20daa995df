#pragma once

#include <cstddef>
#include <deque>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "modules/core/camera/frame.hpp"
#include "modules/core/data/stamped_pose.hpp"
#include "modules/recordings/ros_messages.hpp"
#include "modules/sensors/dataset_reader.hpp"

namespace km {

/// Inertial samples before they are put into packets.
class ImuStream {
 public:
  /// Time by which the samples of the first packet precede its frame, so that odometry can start
  /// with samples from before the first image.
  static constexpr double kLeadIn_s = 1.0;
  /// Longest time by which samples of a packet precede its frame. After a longer pause of the
  /// cameras odometry starts again, so that older samples are of no use.
  static constexpr double kLongest_s = 60.0;

  /// Stamps must ascend.
  void add(const ImuSample& sample);

  /// True if a sample at or after the stamp has been added.
  [[nodiscard]] bool reaches(Stamp stamp) const {
    return !samples_.empty() && samples_.back().stamp >= stamp;
  }
  /// Empty if samples at or before the stamp and at or after it have been added; otherwise as in
  /// "end 37.0 s before it: are the clocks different?".
  [[nodiscard]] std::string why_not(Stamp stamp) const;

  /// The samples of the packet whose frame has this stamp (see SensorPacket). The last sample is
  /// also the first sample of the next packet. Preconditions: why_not(stamp) is empty; stamps
  /// ascend from call to call.
  [[nodiscard]] std::vector<ImuSample> until(Stamp stamp);

  /// The next packet begins at this stamp. Precondition: no packet has been made.
  void begin_at(Stamp stamp);

  /// Bounds the memory of a stream whose cameras pause.
  void drop_before(Stamp stamp);

  /// Counts pauses between `samples` of this stream in `report`, each with `place`, length and
  /// start. A pause has more than kGapPeriods, so that a single lost sample does not count. The
  /// period is the median of the first intervals, at least that of the stated rate [Hz].
  void report_gaps(std::span<const ImuSample> samples, double stated_hz, const std::string& place,
                   ReaderReport& report) const;
  static constexpr double kGapPeriods = 2.5;

 private:
  std::deque<ImuSample> samples_;
  std::optional<Stamp> first_;       // first stamp of the stream
  std::vector<double> intervals_s_;  // the first ones
  bool has_begun_ = false;
};

/// Makes inertial samples from a gyroscope and an accelerometer that have their own stamps. There
/// is one sample for each gyroscope reading. Its acceleration is interpolated linearly between the
/// two readings around it.
class ImuJoiner {
 public:
  struct Reading {
    Stamp stamp = 0;
    Eigen::Vector3d value = Eigen::Vector3d::Zero();
  };

  /// Precondition: the stamps of each sensor ascend. Readings that wait for the other sensor longer
  /// than ImuStream::kLongest_s are dropped.
  void add_gyro(const Reading& reading);
  void add_accel(const Reading& reading);

  /// The next complete sample; nullopt if further readings are needed.
  [[nodiscard]] std::optional<ImuSample> next();

  /// Number of gyroscope readings that yielded no sample, because the accelerations around them are
  /// missing or more than kLongestStep_s apart.
  [[nodiscard]] std::size_t lost() const { return lost_; }

  static constexpr double kLongestStep_s = 0.1;

 private:
  std::deque<Reading> gyro_, accel_;
  std::size_t lost_ = 0;
};

/// Interpolates the poses of an odometry at the stamps of frames.
class PoseStream {
 public:
  /// Longest step over which poses are interpolated.
  static constexpr double kLongestStep_s = 1.0;

  /// Stamps must ascend.
  void add(Stamp stamp, const MeasuredPose& pose);

  /// Bounds the memory of a stream whose cameras pause.
  void drop_before(Stamp stamp) {
    while (!poses_.empty() && poses_.front().stamp < stamp) poses_.pop_front();
  }

  /// As in ImuStream.
  [[nodiscard]] bool reaches(Stamp stamp) const {
    return !poses_.empty() && poses_.back().stamp >= stamp;
  }
  [[nodiscard]] std::string why_not(Stamp stamp) const;

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
/// [m^2], [rad^2]. An invalid or unknown (-1 first) covariance becomes zero.
[[nodiscard]] MeasuredPose measured_pose(const SE3& T_odom_child, const Matrix6& covariance,
                                         const SE3& T_child_body);

/// The pose of the body from a message of ROS; nullopt if its numbers are no pose.
[[nodiscard]] std::optional<MeasuredPose> measured_pose(const RosOdometry& message,
                                                        const SE3& T_child_body);

/// The packets of another reader with the poses of a file. Frames without a pose in the file are
/// skipped and counted.
class PoseFileReader final : public DatasetReader {
 public:
  /// `poses`: of the body, in `file`, whose other rows have `faults`. Stamps out of order are
  /// skipped and counted. Throws DatasetError if there is no pose.
  PoseFileReader(std::unique_ptr<DatasetReader> reader, const std::filesystem::path& file,
                 const UncertainTrajectory& poses, const ReaderReport& faults);

  [[nodiscard]] const SensorRig& rig() const override { return reader_->rig(); }
  using DatasetReader::next;
  [[nodiscard]] std::optional<SensorPacket> next(const ChooseUse& choose) override;
  [[nodiscard]] ReaderReport report() const override;
  [[nodiscard]] std::size_t pair_count() const override { return reader_->pair_count(); }
  [[nodiscard]] std::vector<std::string> remarks() const override { return reader_->remarks(); }
  [[nodiscard]] bool gives_poses() const override { return true; }
  void stop() noexcept override { reader_->stop(); }

 private:
  std::unique_ptr<DatasetReader> reader_;
  std::string name_;
  ReaderReport report_;
  PoseStream poses_;
};

}  // namespace km
