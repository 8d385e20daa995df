#include "modules/sensors/synchrony.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "modules/core/text_table.hpp"
#include "modules/recordings/stamp_statistics.hpp"

namespace km {

Synchrony find_synchrony(std::span<const Stamp> left, std::span<const Stamp> other) {
  Synchrony found;
  if (left.size() < 2) return found;
  std::vector<double> intervals_s;
  for (std::size_t i = 1; i < left.size(); ++i)
    intervals_s.push_back(seconds_between(left[i - 1], left[i]));
  std::ranges::nth_element(intervals_s, intervals_s.begin() + std::ssize(intervals_s) / 2);
  const double interval_s = intervals_s[intervals_s.size() / 2];
  const StampAgreement agreement = stamp_agreement(left, other, 0.5 * interval_s);
  if (agreement.pairs == 0) return found;
  found.offset_s = agreement.median_offset_s;
  found.is_simultaneous = agreement.largest_deviation_s <= found.tolerance_s;
  if (!found.is_simultaneous)
    found.tolerance_s = std::max(found.tolerance_s,
                                 std::min(2.0 * agreement.largest_deviation_s, 0.25 * interval_s));
  return found;
}

bool is_remarkable(const Synchrony& synchrony) {
  constexpr double kUnremarkable_s = 5e-5;
  return std::abs(synchrony.offset_s) > kUnremarkable_s || !synchrony.is_simultaneous;
}

std::string to_string(const Synchrony& synchrony, const char* other) {
  const double offset_ms = 1e3 * synchrony.offset_s;
  return std::string("the ") + other + " image is stamped " + fixed(std::abs(offset_ms), 2) +
         " ms " + (offset_ms < 0.0 ? "before" : "after") + " the left one, within " +
         fixed(1e3 * synchrony.tolerance_s, 2) + " ms" +
         (synchrony.is_simultaneous ? "" : ": they are not triggered together");
}

}  // namespace km
