#pragma once

#include <cstddef>
#include <deque>
#include <optional>

#include "modules/core/stamp.hpp"

namespace km {

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

}  // namespace km
