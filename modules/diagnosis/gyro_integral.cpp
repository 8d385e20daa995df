#include "modules/diagnosis/gyro_integral.hpp"

#include <algorithm>

namespace km {

GyroIntegral::GyroIntegral(std::span<const ImuSample> samples) : samples_(samples) {
  sums_.reserve(samples.size());
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t k = 0; k < samples.size(); ++k) {
    if (k > 0)
      sum += 0.5 * (samples[k - 1].gyro + samples[k].gyro) *
             seconds_between(samples[k - 1].stamp, samples[k].stamp);
    sums_.push_back(sum);
  }
}

bool GyroIntegral::covers(Stamp from, Stamp to) const {
  return !samples_.empty() && samples_.front().stamp <= from && to <= samples_.back().stamp;
}

Eigen::Vector3d GyroIntegral::until(Stamp stamp) const {
  const auto after = std::ranges::upper_bound(samples_, stamp, {}, &ImuSample::stamp);
  const auto k =
      static_cast<std::size_t>(std::min(after, samples_.end() - 1) - samples_.begin() - 1);
  const ImuSample &a = samples_[k], &b = samples_[k + 1];
  const double s = seconds_between(a.stamp, stamp), step_s = seconds_between(a.stamp, b.stamp);
  return sums_[k] + s * (a.gyro + 0.5 * s / step_s * (b.gyro - a.gyro));
}

}  // namespace km
