#pragma once

#include <cstddef>
#include <deque>
#include <optional>

#include "modules/core/stamp.hpp"

namespace km {

/// What an interval between two images of a camera says.
struct ImageGap {
  std::size_t missing = 0;  ///< Images lost in between.
  double pause_s = 0.0;     ///< So long its driver stood still, which loses none; 0: it did not.
};

/// Counts, by their stamps, the images of a camera that are missing between those that come: lost
/// on the way, or overwritten before they were taken, which nobody else tells.
class MissingImages {
 public:
  /// Between the image before and this one, `stamp` later than that: by the usual interval, the
  /// median of the last kIntervals. Nothing until there are kFewest.
  [[nodiscard]] ImageGap before(Stamp stamp);

  static constexpr std::size_t kIntervals = 31;
  static constexpr std::size_t kFewest = 10;
  /// Networks lose images for about a second; cameras and recorders are started again in more.
  static constexpr double kPause_s = 2.0;

 private:
  std::optional<Stamp> last_;
  std::deque<Stamp> intervals_;
};

}  // namespace km
