#include "modules/sensors/stamp_order.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <optional>

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

}  // namespace km
