#pragma once

#include <algorithm>
#include <cmath>

namespace km {

/// How much noisier than assumed the gyroscope is against images: what it and the estimate differ
/// by from image to image, in standard deviations as assumed, root mean square over the last
/// seconds. An estimate between images and samples differs from the latter by less than their
/// noise, so as long as that is no larger than assumed, the scale is 1.
class GyroNoiseScale {
 public:
  static constexpr double kMost = 4.0;
  static constexpr double kMemory_s = 3.0;

  /// Over `dt_s` between two images the estimate turns by `difference_rad` from what the samples
  /// say, which are uncertain by `variance_rad2`, the sum over three axes, if noise is as assumed.
  void add(double difference_rad, double variance_rad2, double dt_s) {
    const double misfit = std::min(difference_rad * difference_rad / variance_rad2, kMost * kMost);
    misfit_ += std::min(dt_s / kMemory_s, 1.0) * (misfit - misfit_);
  }

  /// Of the standard deviation; 1 to kMost.
  [[nodiscard]] double scale() const { return std::sqrt(std::max(misfit_, 1.0)); }

 private:
  double misfit_ = 0.0;  // mean square
};

}  // namespace km
