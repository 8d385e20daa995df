#pragma once

#include <cstddef>
#include <deque>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "modules/core/frame.hpp"
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

  /// starts_by(): a sample at or before the stamp has been added. reaches(): a sample at or after
  /// the stamp has been added.
  [[nodiscard]] bool starts_by(Stamp stamp) const { return first_ && *first_ <= stamp; }
  [[nodiscard]] bool reaches(Stamp stamp) const {
    return !samples_.empty() && samples_.back().stamp >= stamp;
  }

  /// The samples of the packet whose frame has this stamp (see SensorPacket). The last sample is
  /// also the first sample of the next packet. Preconditions: starts_by(stamp) and reaches(stamp);
  /// stamps ascend from call to call.
  [[nodiscard]] std::vector<ImuSample> until(Stamp stamp);

  /// The next packet begins at this stamp. Precondition: no packet has been made.
  void begin_at(Stamp stamp);

  /// Bounds the memory of a stream whose cameras pause.
  void drop_before(Stamp stamp);

 private:
  std::deque<ImuSample> samples_;
  std::optional<Stamp> first_;  // first stamp of the stream
  bool has_begun_ = false;
};

/// Counts pauses of an inertial sensor in `report`, each with `place`, length and start. A pause
/// has more than 2.5 periods, so that a single lost sample does not count.
void report_gaps(std::span<const ImuSample> samples, double rate_hz, const std::string& place,
                 ReaderReport& report);

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

}  // namespace km
