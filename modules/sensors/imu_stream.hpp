#pragma once

#include <cstddef>
#include <deque>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "modules/core/frame.hpp"

namespace km {

/// Inertial samples on their way into packets.
class ImuStream {
 public:
  /// The first packet begins so long before its frame, as far as there are samples: odometry can
  /// begin with what was felt before the first image.
  static constexpr double kLeadIn_s = 1.0;

  /// Later than the one before.
  void add(const ImuSample& sample);

  [[nodiscard]] bool is_empty() const { return samples_.empty(); }

  /// There were samples at or before the stamp, and there are at or after it.
  [[nodiscard]] bool starts_by(Stamp stamp) const { return first_ && *first_ <= stamp; }
  [[nodiscard]] bool reaches(Stamp stamp) const {
    return !samples_.empty() && samples_.back().stamp >= stamp;
  }

  /// The samples of the packet whose frame has this stamp (see SensorPacket), of which the last one
  /// is the first of the next packet. Both of the above hold; stamps ascend from call to call.
  [[nodiscard]] std::vector<ImuSample> until(Stamp stamp);

  /// No packet was made yet, and none will be before this stamp.
  void begin_at(Stamp stamp);

 private:
  std::deque<ImuSample> samples_;
  std::optional<Stamp> first_;  // of all that came
  bool has_begun_ = false;
};

/// A pause of an inertial sensor.
struct ImuGap {
  Stamp after = 0;  ///< The sample before it.
  double length_s = 0.0;
};

/// Where the samples are more than 2.5 periods apart: one lost sample is no gap.
[[nodiscard]] std::vector<ImuGap> imu_gaps(std::span<const ImuSample> samples, double rate_hz);

/// "0.25 s after 1403636579758555392".
[[nodiscard]] std::string to_string(const ImuGap& gap);

/// Makes inertial samples of a gyroscope and an accelerometer that have stamps of their own: one
/// for each of the gyroscope, with the acceleration interpolated linearly between the two around
/// it.
class ImuJoiner {
 public:
  struct Reading {
    Stamp stamp = 0;
    Eigen::Vector3d value = Eigen::Vector3d::Zero();
  };

  /// Each later than the one before.
  void add_gyro(const Reading& reading) { gyro_.push_back(reading); }
  void add_accel(const Reading& reading) { accel_.push_back(reading); }

  /// The next sample that is complete.
  [[nodiscard]] std::optional<ImuSample> next();

  /// Readings of the gyroscope so far that no sample was made of: there are no accelerations around
  /// them that are at most kLongestStep_s apart.
  [[nodiscard]] std::size_t lost() const { return lost_; }

  static constexpr double kLongestStep_s = 0.1;

 private:
  std::deque<Reading> gyro_, accel_;
  std::size_t lost_ = 0;
};

}  // namespace km
