#pragma once

#include <limits>

namespace km {

/// How fast a recording is played.
struct PlaybackPace {
  double rate = 1.0;  ///< Seconds of the recording per second; infinity: as fast as possible.
  /// If the robot is too slow, the recording waits for it, and every image is used. Otherwise the
  /// robot leaves images out, as it does with live cameras. An infinite rate always waits.
  bool waits = true;

  [[nodiscard]] static PlaybackPace fastest() {
    return {std::numeric_limits<double>::infinity(), true};
  }
};

}  // namespace km
