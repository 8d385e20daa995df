#pragma once

#include <span>
#include <vector>

#include "modules/core/frame.hpp"

namespace km {

/// The integral of a gyroscope's rates, linear between samples. The samples must outlive this.
class GyroIntegral {
 public:
  explicit GyroIntegral(std::span<const ImuSample> samples);

  /// True if samples cover the interval.
  [[nodiscard]] bool covers(Stamp from, Stamp to) const;

  /// Integral from the first sample on [rad]. Precondition: covered.
  [[nodiscard]] Eigen::Vector3d until(Stamp stamp) const;

  /// Mean rate [rad/s]. Precondition: covered, from < to.
  [[nodiscard]] Eigen::Vector3d mean(Stamp from, Stamp to) const {
    return (until(to) - until(from)) / seconds_between(from, to);
  }

 private:
  std::span<const ImuSample> samples_;
  std::vector<Eigen::Vector3d> sums_;  // integral up to each sample
};

}  // namespace km
