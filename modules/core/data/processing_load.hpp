#pragma once

#include <optional>

#include "modules/core/stamp.hpp"

namespace km {

/// Report that odometry has finished with a frame.
struct ProcessedFrame {
  Stamp stamp = 0;
  /// Share of the features of the previous image that odometry still tracks, in [0, 1]; nullopt: no
  /// image was tracked.
  std::optional<double> tracked_share = {};
};

/// Frames that a robot drops because its processors are too slow; see LoadShedding.
struct ShedLoad {
  bool map = false;  ///< No new frames for the map.
  int stride = 1;    ///< Odometry gets every stride-th image.

  friend bool operator==(const ShedLoad&, const ShedLoad&) = default;
};

}  // namespace km
