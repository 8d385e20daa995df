#include "modules/sensors/stream_stamps.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <utility>

#include "modules/core/io/text_table.hpp"
#include "modules/core/quantile.hpp"
#include "modules/recordings/bag_summary.hpp"

namespace km {
namespace {

constexpr auto kLongestPause = static_cast<Stamp>(1e9 * kLongestPause_s);

// Positions in `stamps` of a longest strictly ascending subsequence of the stamps in [first, last].
// If there are several: one that ends on the smallest stamp, and before it on the first in the
// list.
std::vector<std::size_t> longest_ascent(std::span<const Stamp> stamps, Stamp first, Stamp last) {
  // [k]: ends of ascents of k + 1 stamps, in the order of the list, on ever smaller stamps.
  std::vector<std::vector<std::size_t>> ends;
  std::vector<std::size_t> before(stamps.size());  // previous position in the ascent
  for (std::size_t i = 0; i < stamps.size(); ++i) {
    if (stamps[i] < first || stamps[i] > last) continue;
    auto end = std::ranges::lower_bound(
        ends, stamps[i], {}, [&](const auto& positions) { return stamps[positions.back()]; });
    if (end != ends.end() && stamps[end->back()] == stamps[i]) continue;  // the first one counts
    if (end != ends.begin())
      before[i] = *std::ranges::partition_point(
          *std::prev(end), [&](std::size_t k) { return stamps[k] >= stamps[i]; });
    if (end == ends.end()) end = ends.emplace(end);
    end->push_back(i);
  }
  std::vector<std::size_t> ascent(ends.size());
  std::size_t i = ends.empty() ? 0 : ends.back().back();
  for (std::size_t k = ends.size(); k-- > 0; i = before[i]) ascent[k] = i;
  return ascent;
}

// The longest ascent among stamps without a pause of more than kLongestPause between them.
std::vector<std::size_t> good_stamps(std::span<const Stamp> stamps) {
  std::vector<Stamp> sorted(stamps.begin(), stamps.end());
  std::ranges::sort(sorted);
  std::vector<std::size_t> good;
  for (std::size_t begin = 0, end = 0; begin < sorted.size(); begin = end) {
    for (end = begin + 1; end < sorted.size() && sorted[end] - sorted[end - 1] <= kLongestPause;)
      ++end;
    if (end - begin <= good.size()) continue;
    const auto ascent = longest_ascent(stamps, sorted[begin], sorted[end - 1]);
    if (ascent.size() > good.size()) good = ascent;
  }
  return good;
}

}  // namespace

std::vector<StampVerdict> judge_stamps(std::span<const Stamp> stamps) {
  std::vector<StampVerdict> verdicts(stamps.size(), StampVerdict::kUnordered);
  if (stamps.empty()) return verdicts;
  const std::vector<std::size_t> good = good_stamps(stamps);
  for (const std::size_t i : good) verdicts[i] = StampVerdict::kGood;

  auto next = good.begin();
  std::optional<Stamp> last;
  for (std::size_t i = 0; i < stamps.size(); ++i) {
    if (next != good.end() && i == *next) {
      last = stamps[*next++];
      continue;
    }
    const bool after = !last || stamps[i] > *last;
    const bool before = next == good.end() || stamps[i] < stamps[*next];
    if (stamps[i] == last) verdicts[i] = StampVerdict::kRepeated;
    if (after && before) verdicts[i] = StampVerdict::kJump;
  }
  return verdicts;
}

StampVerdict StampOrder::judge(Stamp stamp) {
  // Stamps of messages are arbitrary numbers: their differences may overflow a Stamp.
  const auto is_near = [](Stamp a, Stamp b) {
    return std::abs(static_cast<double>(a) - static_cast<double>(b)) <=
           static_cast<double>(kLongestPause);
  };
  if (!last_ || is_near(*last_, stamp)) {
    jumps_ = 0;
    if (last_ && stamp == *last_) return StampVerdict::kRepeated;
    if (last_ && stamp < *last_) return StampVerdict::kUnordered;
    last_ = stamp;
    good_ = std::min(good_ + 1, kNewTimes);
    return StampVerdict::kGood;
  }
  const bool continues = jumps_ > 0 && stamp > *jump_ && is_near(*jump_, stamp);
  jumps_ = continues ? jumps_ + 1 : 1;
  jump_ = stamp;
  if (jumps_ < kNewTimes || (stamp < *last_ && good_ == kNewTimes)) return StampVerdict::kJump;
  last_ = stamp;
  good_ = 1;
  jumps_ = 0;
  return StampVerdict::kGood;
}

// Moves a stamp by the last step or the one before, whichever is nearer to the present.
Stamp ContinuousTime::moved(Stamp stamp) const {
  // Arbitrary numbers: sums may overflow a Stamp.
  const auto by = [stamp](Stamp offset) {
    return static_cast<Stamp>(static_cast<std::uint64_t>(stamp) +
                              static_cast<std::uint64_t>(offset));
  };
  const auto distance = [this](Stamp time) {
    return std::abs(static_cast<double>(time) - static_cast<double>(newest_));
  };
  const Stamp here = by(offset_), before = by(former_);
  return distance(before) < distance(here) ? before : here;
}

Stamp ContinuousTime::of(std::size_t stream, Stamp stamp) {
  Stream& own = streams_.at(stream);
  step_s_ = 0.0;
  const Stamp time = moved(stamp);
  const bool is_back =
      own.good == kNewTimes && stamp > 0 &&
      static_cast<double>(time) < static_cast<double>(*own.last) - 1e9 * kLeastStep_s;
  const bool continues =
      own.back > 0 && stamp > own.last_back && stamp - own.last_back <= kLongestPause;
  own.back = is_back ? (continues ? own.back + 1 : 1) : 0;
  if (own.back == 1) own.first_back = stamp;
  own.last_back = stamp;
  if (own.back < kNewTimes) return time;
  step_s_ = seconds_between(time, newest_);
  former_ = offset_;
  offset_ = newest_ - own.first_back + (stamp - own.first_back) / (kNewTimes - 1);
  own.back = 0;
  return stamp + offset_;
}

std::optional<Stamp> ContinuousTime::between(std::size_t stream, Stamp stamp, Stamp next) const {
  const std::optional<Stamp>& last = streams_.at(stream).last;
  const Stamp time = moved(stamp);
  return last && *last < time && time < next ? std::optional(time) : std::nullopt;
}

void ContinuousTime::accept(std::size_t stream, Stamp continuous) {
  Stream& own = streams_.at(stream);
  own.last = continuous;
  own.good = std::min(own.good + 1, kNewTimes);
  newest_ = std::max(newest_, continuous);
}

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
    if (interval_s > kLongestPause_s) return gap;  // the clock was set
    if (share > kGap && interval_s > kPause_s)
      gap.pause_s = interval_s;
    else if (share > kGap)
      gap.missing = static_cast<std::size_t>(std::lround(share)) - 1;
  }
  intervals_.push_back(interval);
  if (intervals_.size() > kIntervals) intervals_.pop_front();
  return gap;
}

Synchrony find_synchrony(std::span<const Stamp> left, std::span<const Stamp> other) {
  Synchrony found;
  if (left.size() < 2) return found;
  std::vector<double> intervals_s;
  for (std::size_t i = 1; i < left.size(); ++i)
    intervals_s.push_back(seconds_between(left[i - 1], left[i]));
  const double interval_s = quantile(std::move(intervals_s), 0.5);
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
