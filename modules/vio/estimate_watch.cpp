#include "modules/vio/estimate_watch.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace km {

void EstimateWatch::add(const ImageFit& fit) {
  judges_all_ = judges_all_ && fit.points >= kMinPoints;
  if (fit.points < kMinPoints) return;
  const bool contradicts = fit.contradicting > kContradictingShare * fit.points;
  const double step = contradicts ? std::log(kTrueRate / kFalseRate)
                                  : std::log((1.0 - kTrueRate) / (1.0 - kFalseRate));
  evidence_ = std::max(evidence_ + step, 0.0);
  constexpr double kMedianSquare = 2.0 * std::numbers::ln2;  // chi-squared, 2 degrees of freedom
  factors_ += fit.median_square / kMedianSquare;
  ++images_;
}

double EstimateWatch::variance_factor() const {
  if (images_ == 0) return 1.0;
  return std::max(factors_ / images_, judges_all_ ? 0.0 : 1.0);
}

void EstimateWatch::start_keyframe() {
  factors_ = 0.0;
  images_ = 0;
  judges_all_ = true;
}

}  // namespace km
