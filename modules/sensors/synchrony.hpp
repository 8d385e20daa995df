#pragma once

#include <span>
#include <string>

#include "modules/core/stamp.hpp"

namespace km {

/// How the stamps of images that belong to one instant differ: the cameras of a rig may be
/// triggered together and yet be stamped apart by a constant.
struct Synchrony {
  double offset_s = 0.0;        ///< Of the other image, after the left one.
  double tolerance_s = 1e-3;    ///< Largest difference from that.
  bool is_simultaneous = true;  ///< False: the cameras are not triggered together.
};

/// What the first stamps of two cameras, both sorted, tell. Their images belong together where the
/// stamps are each other's nearest and less than half an interval of the left ones apart; the
/// tolerance is a millisecond, or, where that does not hold them, twice the largest deviation, and
/// at most a quarter of an interval. The default where there are no such pairs.
[[nodiscard]] Synchrony find_synchrony(std::span<const Stamp> left, std::span<const Stamp> other);

/// False if it is as usual: stamps that are equal to a twentieth of a millisecond.
[[nodiscard]] bool is_remarkable(const Synchrony& synchrony);

/// "the right image is stamped 2.00 ms after the left one, within 1.00 ms".
[[nodiscard]] std::string to_string(const Synchrony& synchrony, const char* other);

}  // namespace km
