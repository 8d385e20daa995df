#pragma once

#include <cstddef>
#include <deque>
#include <optional>
#include <span>
#include <string>
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

/// Continues the stamps of several streams after their clock was set back, or after a recording has
/// begun again. The clock was set back if kNewTimes stamps of a stream in a row are more than
/// kLeastStep_s before its last good stamp, and ascend. Later stamps of all streams are then moved,
/// so that time continues. Streams of another clock, and late messages from before the step, are
/// not moved.
class ContinuousTime {
 public:
  static constexpr int kNewTimes = StampOrder::kNewTimes;
  static constexpr double kLeastStep_s = 0.5;

  explicit ContinuousTime(std::size_t streams) : streams_(streams) {}

  /// The stamp in continuous time, of a clock that `stream` uses.
  [[nodiscard]] Stamp of(std::size_t stream, Stamp stamp);

  /// The continuous time of a stamp of `stream` that was not good, if it is between the last
  /// accepted time and `next`: then the clock was set before it. Otherwise nullopt.
  [[nodiscard]] std::optional<Stamp> between(std::size_t stream, Stamp stamp, Stamp next) const;

  /// Notes that a stamp of of() is good.
  void accept(std::size_t stream, Stamp continuous);

  /// The time [s] by which the clock was set back at the last call of of(); 0: it was not.
  [[nodiscard]] double step_s() const { return step_s_; }

 private:
  struct Stream {
    std::optional<Stamp> last;  // continuous, of the last good stamp
    int good = 0;               // good stamps, at most kNewTimes
    int back = 0;               // stamps in a row before the last good stamp
    Stamp first_back = 0, last_back = 0;
  };

  [[nodiscard]] Stamp moved(Stamp stamp) const;

  std::vector<Stream> streams_;
  Stamp offset_ = 0, former_ = 0;  // added to stamps; before the last step
  Stamp newest_ = 0;               // continuous
  double step_s_ = 0.0;
};

/// Result for an interval between two images of a camera.
struct ImageGap {
  std::size_t missing = 0;  ///< Number of images lost in the interval.
  double pause_s = 0.0;     ///< Pause of the driver, which loses no images; 0: none.
};

/// Counts the missing images of a camera by the stamps of its other images. Missing images were
/// lost in transmission or overwritten before they were read; no other component reports them.
class MissingImages {
 public:
  /// Gap between the previous image and this later image. The usual interval is the median of the
  /// last kIntervals intervals. Zero until there are kFewest intervals.
  [[nodiscard]] ImageGap before(Stamp stamp);

  static constexpr std::size_t kIntervals = 31;
  static constexpr std::size_t kFewest = 10;
  /// Longer gaps are pauses: networks lose images for about a second, while a restart of a camera
  /// or a recorder takes longer.
  static constexpr double kPause_s = 2.0;

 private:
  std::optional<Stamp> last_;
  std::deque<Stamp> intervals_;
};

/// Difference of the stamps of images of one instant. The cameras of a rig may be triggered
/// together although their stamps differ by a constant.
struct Synchrony {
  double offset_s = 0.0;        ///< Stamp of the other image minus stamp of the left image.
  double tolerance_s = 1e-3;    ///< Largest difference from the offset.
  bool is_simultaneous = true;  ///< False: the cameras are not triggered together.
};

/// Synchrony of two cameras from their first stamps, both sorted. Images belong together if their
/// stamps are nearest to each other and less than half an interval of the left images apart. The
/// tolerance is a millisecond. If deviations exceed it, the tolerance is twice the largest
/// deviation, but at most a quarter of an interval. Returns the default if no images belong
/// together.
[[nodiscard]] Synchrony find_synchrony(std::span<const Stamp> left, std::span<const Stamp> other);

/// True if the offset exceeds a twentieth of a millisecond, or if the cameras are not triggered
/// together.
[[nodiscard]] bool is_remarkable(const Synchrony& synchrony);

/// "the right image is stamped 2.00 ms after the left one, within 1.00 ms".
[[nodiscard]] std::string to_string(const Synchrony& synchrony, const char* other);

}  // namespace km
