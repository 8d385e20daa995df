#pragma once

#include <cstddef>
#include <deque>
#include <optional>

#include "modules/core/stamp.hpp"

namespace km {

/// Counts, by their stamps, the images of a camera that are missing between those that come: lost
/// on the way, or overwritten before they were taken, which nobody else tells.
class MissingImages {
 public:
  /// How many are missing between the image before and this one, `stamp` later than that: by the
  /// usual interval, the median of the last kIntervals. 0 until there are kFewest.
  [[nodiscard]] std::size_t before(Stamp stamp);

  static constexpr std::size_t kIntervals = 31;
  static constexpr std::size_t kFewest = 10;

 private:
  std::optional<Stamp> last_;
  std::deque<Stamp> intervals_;
};

}  // namespace km
