#include "modules/vio/estimate_watch.hpp"

#include <algorithm>
#include <cmath>

namespace km {

void EstimateWatch::add(const ImageFit& fit) {
  if (fit.points < kMinPoints) return;
  const bool contradicts = fit.contradicting > kContradictingShare * fit.points;
  const double step = contradicts ? std::log(kTrueRate / kFalseRate)
                                  : std::log((1.0 - kTrueRate) / (1.0 - kFalseRate));
  evidence_ = std::max(evidence_ + step, 0.0);
}

}  // namespace km
