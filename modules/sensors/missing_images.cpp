#include "modules/sensors/missing_images.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace km {

std::size_t MissingImages::before(Stamp stamp) {
  constexpr double kGap = 1.5;  // usual intervals: cameras that expose by the light vary by less
  const std::optional<Stamp> last = std::exchange(last_, stamp);
  if (!last) return 0;
  const Stamp interval = stamp - *last;
  std::size_t missing = 0;
  if (intervals_.size() >= kFewest) {
    std::vector<Stamp> sorted(intervals_.begin(), intervals_.end());
    const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
    std::ranges::nth_element(sorted, middle);
    const double share = static_cast<double>(interval) / static_cast<double>(*middle);
    if (share > kGap) missing = static_cast<std::size_t>(std::lround(share)) - 1;
  }
  intervals_.push_back(interval);
  if (intervals_.size() > kIntervals) intervals_.pop_front();
  return missing;
}

}  // namespace km
