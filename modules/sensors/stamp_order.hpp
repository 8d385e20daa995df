#pragma once

#include <optional>
#include <span>
#include <vector>

#include "modules/core/stamp.hpp"

namespace km {

/// Longest pause between the stamps of one recording. A list with a longer pause contains two
/// recordings, or a recording whose clock was set.
inline constexpr double kLongestPause_s = 3600.0;

/// Verdict on a stamp within its list.
enum class StampVerdict {
  kGood,
  kRepeated,   ///< Equal to an earlier good stamp.
  kUnordered,  ///< Out of order with respect to the good stamps.
  kJump,       ///< In order, but more than kLongestPause_s away from most stamps.
};

/// Judges the stamps [ns, positive] of a list, in its order, so that as few as possible are
/// rejected. A single wrong stamp, however large its error, does not affect the stamps after it.
/// The good stamps are a longest subsequence that ascends strictly, among stamps that steps of at
/// most kLongestPause_s join. O(n log n).
[[nodiscard]] std::vector<StampVerdict> judge_stamps(std::span<const Stamp> stamps);

/// Judges the stamps of a stream one by one. Good stamps ascend in steps of at most
/// kLongestPause_s. If kNewTimes stamps in a row jump to one other time, the clock was set. Stamps
/// of this time are then good, unless it is earlier than a time that was good for longer.
class StampOrder {
 public:
  static constexpr int kNewTimes = 3;

  [[nodiscard]] StampVerdict judge(Stamp stamp);

 private:
  std::optional<Stamp> last_;  // last good stamp
  int good_ = 0;               // good stamps since the clock was set, at most kNewTimes
  std::optional<Stamp> jump_;  // last stamp that jumped
  int jumps_ = 0;              // number of jumps in a row to one other time
};

}  // namespace km
