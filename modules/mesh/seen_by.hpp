#pragma once

#include <array>

#include "modules/core/ids.hpp"

namespace km {

/// First and last keyframe that saw a piece of surface.
using SeenBy = std::array<KeyframeIndex, 2>;

/// Keyframes between the last one that saw the earlier surface and the first one that saw the later
/// surface; 0 if the two intervals overlap.
[[nodiscard]] inline KeyframeIndex keyframe_gap(const SeenBy& a, const SeenBy& b) {
  if (a[0] > b[1]) return a[0] - b[1];
  if (b[0] > a[1]) return b[0] - a[1];
  return 0;
}

}  // namespace km
