#include "modules/sensors/stamp_order.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>

namespace km {
namespace {

constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();

// Longest ascending subsequences ("ascents"), found with a segment tree over the stamps.
class Ascents {
 public:
  explicit Ascents(std::span<const Stamp> stamps)
      : stamps_(stamps),
        keys_(stamps.begin(), stamps.end()),
        before_(stamps.size(), kNone),
        length_(stamps.size(), 0) {
    std::sort(keys_.begin(), keys_.end());
    keys_.erase(std::unique(keys_.begin(), keys_.end()), keys_.end());
    tree_.assign(2 * keys_.size(), kNone);
  }

  // Adds the longest ascent that ends on stamps[i], with steps of at most `pause`. Call with
  // i = 0, 1, ... in this order.
  void add(std::size_t i, Stamp pause) {
    before_[i] = best_within(key_of(stamps_[i] - pause), key_of(stamps_[i]));
    length_[i] = before_[i] == kNone ? 1 : length_[before_[i]] + 1;
    std::size_t node = keys_.size() + key_of(stamps_[i]);
    tree_[node] = better(tree_[node], i);
    for (node /= 2; node > 0; node /= 2) tree_[node] = better(tree_[2 * node], tree_[2 * node + 1]);
  }

  // Positions of a longest ascent; if there are several, of one that ends on the smallest stamp.
  [[nodiscard]] std::vector<std::size_t> longest() const {
    std::size_t end = 0;
    for (std::size_t i = 1; i < stamps_.size(); ++i)
      if (length_[i] > length_[end] || (length_[i] == length_[end] && stamps_[i] < stamps_[end]))
        end = i;
    std::vector<std::size_t> positions;
    for (std::size_t i = end; i != kNone; i = before_[i]) positions.push_back(i);
    std::reverse(positions.begin(), positions.end());
    return positions;
  }

 private:
  [[nodiscard]] std::size_t key_of(Stamp stamp) const {
    return static_cast<std::size_t>(std::lower_bound(keys_.begin(), keys_.end(), stamp) -
                                    keys_.begin());
  }

  // The end of the longer ascent; of two equally long ones, the first in the list.
  [[nodiscard]] std::size_t better(std::size_t a, std::size_t b) const {
    if (a == kNone || b == kNone) return std::min(a, b);
    if (length_[a] != length_[b]) return length_[a] > length_[b] ? a : b;
    return std::min(a, b);
  }

  // The best of the ascents that end on keys [from, to).
  [[nodiscard]] std::size_t best_within(std::size_t from, std::size_t to) const {
    std::size_t best = kNone;
    for (from += keys_.size(), to += keys_.size(); from < to; from /= 2, to /= 2) {
      if (from % 2 == 1) best = better(best, tree_[from++]);
      if (to % 2 == 1) best = better(best, tree_[--to]);
    }
    return best;
  }

  std::span<const Stamp> stamps_;
  std::vector<Stamp> keys_;  // ascending
  std::vector<std::size_t> tree_;
  std::vector<std::size_t> before_;  // previous position in the ascent
  std::vector<std::size_t> length_;
};

}  // namespace

std::vector<StampVerdict> judge_stamps(std::span<const Stamp> stamps) {
  std::vector<StampVerdict> verdicts(stamps.size(), StampVerdict::kUnordered);
  if (stamps.empty()) return verdicts;
  Ascents ascents(stamps);
  for (std::size_t i = 0; i < stamps.size(); ++i) ascents.add(i, nanoseconds(kLongestPause_s));
  const std::vector<std::size_t> good = ascents.longest();
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
  const Stamp pause = nanoseconds(kLongestPause_s);
  // Stamps of messages are arbitrary numbers: their differences may overflow a Stamp.
  const auto is_near = [pause](Stamp a, Stamp b) {
    return std::abs(static_cast<double>(a) - static_cast<double>(b)) <= static_cast<double>(pause);
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
