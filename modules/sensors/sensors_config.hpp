#pragma once

#include <limits>

#include "modules/core/config.hpp"

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

/// Parameters of reading and playing a recording.
struct SensorsConfig {
  static constexpr const char* kSection = "sensors";

  double max_lag_s = 0.5;
  bool imu = true;
  bool depth = false;
  bool labels = false;

  void visit_fields(auto& visitor) {
    visitor.field(
        "max_lag_s", max_lag_s, {0.0, 1e6},
        "[s] bound on the delay of odometry. At half of it the map gets no new frames. At this "
        "delay odometry gets every second image, then every third and fourth. At twice this delay "
        "a recording's clock waits, and live images are dropped. Inertial samples are kept. At "
        "--rate auto a recording only waits, at twice this delay");
    visitor.field("imu", imu,
                  "use the inertial sensor; false, or without one: odometry by images alone");
    visitor.field(
        "depth", depth,
        "read depth images although there is a right camera; an RGB-D rig always reads them");
    visitor.field("labels", labels, "read label images");
  }
};

}  // namespace km
