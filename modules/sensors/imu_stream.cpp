#include "modules/sensors/imu_stream.hpp"

#include <algorithm>
#include <iterator>

namespace km {

void ImuStream::add(const ImuSample& sample) {
  if (!first_) first_ = sample.stamp;
  samples_.push_back(sample);
}

std::vector<ImuSample> ImuStream::until(Stamp stamp) {
  if (!has_begun_) begin_at(stamp);
  has_begun_ = true;
  drop_before(stamp - nanoseconds(kLongest_s));
  const auto last = std::ranges::lower_bound(samples_, stamp, {}, &ImuSample::stamp);
  std::vector<ImuSample> packet(samples_.begin(), std::next(last));
  samples_.erase(samples_.begin(), last);
  return packet;
}

void ImuStream::begin_at(Stamp stamp) {
  if (!has_begun_) drop_before(stamp - nanoseconds(kLeadIn_s));
}

void ImuStream::drop_before(Stamp stamp) {
  samples_.erase(samples_.begin(),
                 std::ranges::lower_bound(samples_, stamp, {}, &ImuSample::stamp));
}

void report_gaps(std::span<const ImuSample> samples, double rate_hz, const std::string& place,
                 ReaderReport& report) {
  constexpr double kPeriods = 2.5;
  for (std::size_t i = 1; i < samples.size(); ++i) {
    const Stamp before = samples[i - 1].stamp;
    const double length_s = seconds_between(before, samples[i].stamp);
    if (length_s > kPeriods / rate_hz)
      report.add(ReaderFault::kImuGap,
                 place + ": " + std::to_string(length_s) + " s after " + std::to_string(before));
  }
}

void ImuJoiner::add_gyro(const Reading& reading) {
  const Stamp oldest = reading.stamp - nanoseconds(ImuStream::kLongest_s);
  for (; !gyro_.empty() && gyro_.front().stamp < oldest; gyro_.pop_front()) ++lost_;
  gyro_.push_back(reading);
}

void ImuJoiner::add_accel(const Reading& reading) {
  const Stamp oldest = reading.stamp - nanoseconds(ImuStream::kLongest_s);
  while (!accel_.empty() && accel_.front().stamp < oldest) accel_.pop_front();
  accel_.push_back(reading);
}

std::optional<ImuSample> ImuJoiner::next() {
  while (!gyro_.empty() && !accel_.empty()) {
    const Reading& turn = gyro_.front();
    while (accel_.size() > 1 && accel_[1].stamp <= turn.stamp) accel_.pop_front();
    const Reading& before = accel_.front();
    const bool started_later = before.stamp > turn.stamp;
    if (!started_later && before.stamp < turn.stamp && accel_.size() < 2) return std::nullopt;
    const Reading& after = before.stamp == turn.stamp ? before : accel_[started_later ? 0 : 1];
    const double step_s = seconds_between(before.stamp, after.stamp);
    const Stamp stamp = turn.stamp;
    const Eigen::Vector3d gyro = turn.value;
    gyro_.pop_front();
    if (started_later || step_s > kLongestStep_s) {
      ++lost_;
      continue;
    }
    const double share = step_s > 0.0 ? seconds_between(before.stamp, stamp) / step_s : 0.0;
    return ImuSample{stamp, gyro, before.value + share * (after.value - before.value)};
  }
  return std::nullopt;
}

}  // namespace km
