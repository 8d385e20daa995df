#pragma once

#include <span>
#include <string>

#include "modules/core/stamp.hpp"

namespace km {

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
