#include "modules/sensors/sample_streams.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "modules/core/data/covariance.hpp"
#include "modules/core/geometry/lie.hpp"
#include "modules/core/io/text_table.hpp"
#include "modules/core/quantile.hpp"
#include "modules/sensors/text_file.hpp"

namespace km {
namespace {

// See ImuStream::why_not(). `first`, `last`: stamps of a stream.
std::string why_not_between(std::optional<Stamp> first, Stamp last, Stamp stamp) {
  constexpr double kOtherClock_s = 2.0, kYear_s = 3.2e7;
  if (first && *first <= stamp && last >= stamp) return {};
  if (!first) return "are missing";
  const bool is_late = *first > stamp;
  const double seconds = seconds_between(is_late ? stamp : last, is_late ? *first : stamp);
  return (is_late ? "start " : "end ") + fixed(seconds, 1) +
         (is_late ? " s after it" : " s before it") +
         (seconds > kYear_s
              ? ": one of them has stamps of another clock, unit or column (an index?)"
          : seconds > kOtherClock_s ? ": are the clocks different?"
                                    : "");
}

}  // namespace

std::string ImuStream::why_not(Stamp stamp) const {
  return why_not_between(first_, samples_.empty() ? first_.value_or(0) : samples_.back().stamp,
                         stamp);
}

void ImuStream::add(const ImuSample& sample) {
  constexpr std::size_t kIntervals = 100;
  if (!first_) first_ = sample.stamp;
  if (!samples_.empty() && intervals_s_.size() < kIntervals)
    intervals_s_.push_back(seconds_between(samples_.back().stamp, sample.stamp));
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

void ImuStream::report_gaps(std::span<const ImuSample> samples, double stated_hz,
                            const std::string& place, ReaderReport& report) const {
  for (std::size_t i = 1; i < samples.size(); ++i) {
    const Stamp before = samples[i - 1].stamp;
    const double length_s = seconds_between(before, samples[i].stamp);
    if (length_s > kGapPeriods / stated_hz && length_s > kGapPeriods * quantile(intervals_s_, 0.5))
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

std::string PoseStream::why_not(Stamp stamp) const {
  return why_not_between(first_, poses_.empty() ? first_.value_or(0) : poses_.back().stamp, stamp);
}

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
  const Matrix6 known = is_covariance(covariance) ? covariance : Matrix6(Matrix6::Zero());
  const UncertainPose odom_child{T_odom_child, from_fixed_axes(T_odom_child, known)};
  const UncertainPose odom_body = compose(odom_child, {T_child_body, Matrix6::Zero()});
  return {odom_body.T, odom_body.Sigma};
}

std::optional<MeasuredPose> measured_pose(const RosOdometry& message, const SE3& T_child_body) {
  constexpr double kMaxNormError = 1e-3;
  const Eigen::Quaterniond& q = message.pose.pose.orientation;
  if (!(std::abs(q.norm() - 1.0) < kMaxNormError) || !message.pose.pose.position.allFinite())
    return std::nullopt;
  return measured_pose(make_pose(q.normalized().toRotationMatrix(), message.pose.pose.position),
                       Eigen::Map<const Matrix6>(message.pose.covariance.data()), T_child_body);
}

PoseFileReader::PoseFileReader(std::unique_ptr<DatasetReader> reader,
                               const std::filesystem::path& file, const UncertainTrajectory& poses,
                               const ReaderReport& faults)
    : reader_(std::move(reader)), name_(file.string()), report_(faults) {
  std::vector<Stamp> stamps;
  for (const StampedPose& pose : poses.poses) stamps.push_back(pose.stamp);
  const std::vector<bool> counts = in_order(stamps, poses.lines, file, report_);
  for (std::size_t k = 0; k < stamps.size(); ++k) {
    const Matrix6& Sigma = poses.covariances[k];
    if (counts[k])
      poses_.add(stamps[k], {poses.poses[k].T, is_covariance(Sigma) ? Sigma : Matrix6::Zero()});
  }
  if (stamps.empty()) refuse_list(file, "no pose in it", faults);
}

std::optional<SensorPacket> PoseFileReader::next(const ChooseUse& choose) {
  while (auto packet = reader_->next(choose)) {
    packet->pose = poses_.at(packet->frame->stamp);
    if (packet->pose) return packet;
    report_.add(ReaderFault::kFrameWithoutPose,
                name_ + ": none for the image at " + std::to_string(packet->frame->stamp));
  }
  return std::nullopt;
}

ReaderReport PoseFileReader::report() const {
  ReaderReport all = reader_->report();
  all.add(report_);
  return all;
}

}  // namespace km
