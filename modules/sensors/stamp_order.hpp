#pragma once

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

}  // namespace km
