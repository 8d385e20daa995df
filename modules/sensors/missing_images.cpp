#include "modules/sensors/missing_images.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace km {

ImageGap MissingImages::before(Stamp stamp) {
  constexpr double kGap = 1.5;  // smallest gap in usual intervals, above the effect of exposure
  const std::optional<Stamp> last = std::exchange(last_, stamp);
  if (!last) return {};
  const Stamp interval = stamp - *last;
  ImageGap gap;
  if (intervals_.size() >= kFewest) {
    std::vector<Stamp> sorted(intervals_.begin(), intervals_.end());
    const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
    std::ranges::nth_element(sorted, middle);
    const double share = static_cast<double>(interval) / static_cast<double>(*middle);
    const double interval_s = seconds_between(*last, stamp);
    if (share > kGap && interval_s > kPause_s)
      gap.pause_s = interval_s;
    else if (share > kGap)
      gap.missing = static_cast<std::size_t>(std::lround(share)) - 1;
  }
  intervals_.push_back(interval);
  if (intervals_.size() > kIntervals) intervals_.pop_front();
  return gap;
}

}  // namespace km
