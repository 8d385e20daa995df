#pragma once

#include <optional>
#include <span>
#include <vector>

#include "modules/core/stamp.hpp"

namespace km {

/// A list whose stamps pause for longer contains two recordings, or one whose clock was set. Images
/// and inertial samples do not show what happened in between, and playing it in real time would
/// wait for the whole pause.
inline constexpr double kLongestPause_s = 3600.0;

/// Verdict on a stamp within its list.
enum class StampVerdict {
  kGood,
  kRepeated,   ///< Equal to a good one before.
  kUnordered,  ///< Not after the good ones before it, or not before the good ones after it.
  kJump,       ///< In order, but more than kLongestPause_s away from most stamps.
};

/// Judges the stamps [ns, positive] of a list, in its order, so that as few as possible are
/// rejected. A single wrong stamp, however large its error, does not affect the stamps after it.
/// The good ones are a longest subsequence that ascends strictly and in steps of at most
/// kLongestPause_s. O(n log n).
[[nodiscard]] std::vector<StampVerdict> judge_stamps(std::span<const Stamp> stamps);

/// Judges the stamps of a stream one by one. Good stamps ascend in steps of at most
/// kLongestPause_s. If kNewTimes stamps in a row jump to the same other time, the clock was set.
/// From then on that time is the stream's, unless it is earlier than a time that was good for
/// longer.
class StampOrder {
 public:
  static constexpr int kNewTimes = 3;

  [[nodiscard]] StampVerdict judge(Stamp stamp);

 private:
  std::optional<Stamp> last_;  // last good stamp
  int good_ = 0;               // good stamps since the clock was set, at most kNewTimes
  std::optional<Stamp> jump_;  // last stamp that jumped
  int jumps_ = 0;              // jumps in a row to the same other time
};

}  // namespace km
