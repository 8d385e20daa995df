#include "modules/recordings/stamp_statistics.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <optional>

namespace km {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

// Quantile: the smallest value such that at least `share` of the values are no larger. `values` is
// not empty.
double quantile(std::vector<double> values, double share) {
  const auto rank = static_cast<std::size_t>(
      std::max(1.0, std::ceil(share * static_cast<double>(values.size()))));
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(rank - 1);
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

// seconds_between() for arbitrary stamps, whose difference may overflow a Stamp.
double seconds_from_to(Stamp a, Stamp b) {
  const auto difference =
      static_cast<std::int64_t>(static_cast<std::uint64_t>(b) - static_cast<std::uint64_t>(a));
  const bool overflows = (difference < 0) != (b < a);
  return overflows ? (static_cast<double>(b) - static_cast<double>(a)) * 1e-9
                   : static_cast<double>(difference) * 1e-9;
}

// Index of the stamp nearest to `stamp`. `stamps` are sorted and not empty.
std::size_t nearest(std::span<const Stamp> stamps, Stamp stamp) {
  const auto after = std::lower_bound(stamps.begin(), stamps.end(), stamp);
  const auto index = static_cast<std::size_t>(after - stamps.begin());
  if (after == stamps.begin()) return 0;
  if (after == stamps.end()) return index - 1;
  return seconds_from_to(stamps[index - 1], stamp) < seconds_from_to(stamp, *after) ? index - 1
                                                                                    : index;
}

}  // namespace

StampStatistics stamp_statistics(std::vector<Stamp> stamps) {
  StampStatistics result{
      .count = stamps.size(), .rate_hz = kNone, .largest_gap_s = kNone, .jitter_s = kNone};
  for (std::size_t i = 1; i < stamps.size(); ++i)
    result.unordered += stamps[i] <= stamps[i - 1] ? 1 : 0;
  std::sort(stamps.begin(), stamps.end());
  if (stamps.empty()) return result;
  result.first = stamps.front();
  result.last = stamps.back();
  if (stamps.size() < 2) return result;
  std::vector<double> intervals_s;
  for (std::size_t i = 1; i < stamps.size(); ++i)
    intervals_s.push_back(seconds_from_to(stamps[i - 1], stamps[i]));
  const double total_s = seconds_from_to(result.first, result.last);
  if (total_s > 0.0) result.rate_hz = static_cast<double>(intervals_s.size()) / total_s;
  result.largest_gap_s = *std::max_element(intervals_s.begin(), intervals_s.end());
  const double median_s = quantile(intervals_s, 0.5);
  for (double& interval_s : intervals_s) interval_s = std::abs(interval_s - median_s);
  result.jitter_s = quantile(std::move(intervals_s), 0.95);
  return result;
}

StampAgreement stamp_agreement(std::span<const Stamp> first, std::span<const Stamp> second,
                               double tolerance_s) {
  StampAgreement result{.median_offset_s = kNone, .largest_deviation_s = kNone};
  std::vector<double> offsets_s;
  for (std::size_t i = 0; i < first.size() && !second.empty(); ++i) {
    const std::size_t other = nearest(second, first[i]);
    const double offset_s = seconds_from_to(first[i], second[other]);
    if (nearest(first, second[other]) != i || std::abs(offset_s) > tolerance_s) continue;
    offsets_s.push_back(offset_s);
    result.equal += first[i] == second[other] ? 1 : 0;
  }
  result.pairs = offsets_s.size();
  result.only_first = first.size() - result.pairs;
  result.only_second = second.size() - result.pairs;
  if (offsets_s.empty()) return result;
  result.median_offset_s = quantile(offsets_s, 0.5);
  result.largest_deviation_s = 0.0;
  for (const double offset_s : offsets_s)
    result.largest_deviation_s =
        std::max(result.largest_deviation_s, std::abs(offset_s - result.median_offset_s));
  return result;
}

}  // namespace km
