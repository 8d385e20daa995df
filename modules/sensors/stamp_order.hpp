#pragma once

#include <optional>
#include <span>
#include <vector>

#include "modules/core/stamp.hpp"

namespace km {

/// A list whose stamps pause for longer is two recordings, or one whose clock was set: images and
/// inertial samples do not say what lies between, and playing it in real time would wait as long.
inline constexpr double kLongestPause_s = 3600.0;

/// What a stamp is among those of its list.
enum class StampVerdict {
  kGood,
  kRepeated,   ///< Equal to a good one before.
  kUnordered,  ///< Not after the good ones before it, or not before those after it.
  kJump,       ///< In order, but more than kLongestPause_s away from where most are.
};

/// Judges the stamps [ns, positive] of a list, in its order, so that the fewest are lost: a single
/// wrong one, however far off, costs itself and not what follows it. Good is a longest subsequence
/// that ascends strictly and in steps of at most kLongestPause_s. O(n log n).
[[nodiscard]] std::vector<StampVerdict> judge_stamps(std::span<const Stamp> stamps);

/// Judges the stamps of a stream, each as it comes. Good are those that ascend in steps of at most
/// kLongestPause_s. Where kNewTimes stamps in a row jump to the same other time, the clock was set:
/// from there on that time is the stream's, unless it is earlier than what was good for longer.
class StampOrder {
 public:
  static constexpr int kNewTimes = 3;

  [[nodiscard]] StampVerdict judge(Stamp stamp);

 private:
  std::optional<Stamp> last_;  // good
  int good_ = 0;               // since the clock was set, at most kNewTimes
  std::optional<Stamp> jump_;  // the last that jumped
  int jumps_ = 0;              // in a row, to one other time
};

}  // namespace km
