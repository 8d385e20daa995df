#pragma once

#include <algorithm>
#include <cmath>

namespace km {

/// Factor by which the noise of the gyroscope, judged by images, exceeds the assumed noise. The
/// factor is the root mean square, over the last seconds, of the difference between gyroscope and
/// estimate from image to image, in assumed standard deviations. The estimate uses the samples too,
/// so the difference is less than the noise of the samples. The scale is therefore 1 if the noise
/// is no larger than assumed.
class GyroNoiseScale {
 public:
  static constexpr double kMaxScale = 4.0;
  static constexpr double kTimeConstant_s = 3.0;

  /// Adds an interval of `dt_s` between two images, over which the rotations of estimate and
  /// samples differ by `difference_rad`. `variance_rad2` is the variance of the samples' rotation
  /// under the assumed noise, summed over three axes. A diverged estimate (NaN) adds nothing.
  void add(double difference_rad, double variance_rad2, double dt_s) {
    const double misfit =
        std::min(difference_rad * difference_rad / variance_rad2, kMaxScale * kMaxScale);
    if (std::isnan(misfit)) return;
    misfit_ += std::min(dt_s / kTimeConstant_s, 1.0) * (misfit - misfit_);
  }

  /// Factor on the standard deviation, in [1, kMaxScale].
  [[nodiscard]] double scale() const { return std::sqrt(std::max(misfit_, 1.0)); }

 private:
  double misfit_ = 0.0;  // running mean of the squared ratio of difference to assumed deviation
};

}  // namespace km
