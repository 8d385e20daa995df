#pragma once

#include "modules/core/config.hpp"

namespace km {

/// Parameters of reading and playing a recording. Field names are the YAML keys below `sensors:`.
struct SensorsConfig {
  static constexpr const char* kSection = "sensors";

  /// Largest difference between the stamps of the two images of a pair [s].
  double stereo_tolerance_s = 1e-3;

  /// Stereo pairs decoded ahead of the one being published, so that nobody waits for a decoder.
  int read_ahead = 8;

  /// At a real-time rate, a pair that would be published later than this is skipped, as a camera
  /// would overwrite it [s]. Its inertial samples stay. Larger: slow consumers lose less, later.
  double max_lag_s = 0.5;

  /// Depth images are read also where a right camera gives depth. An RGB-D rig always reads them.
  bool depth = false;

  /// Label images are read.
  bool labels = false;

  void visit_fields(auto& visitor) {
    visitor.field("stereo_tolerance_s", stereo_tolerance_s, {0.0, 0.1},
                  "[s] largest difference between the stamps of left and right");
    visitor.field("read_ahead", read_ahead, {1, 1000}, "stereo pairs decoded ahead");
    visitor.field("max_lag_s", max_lag_s, {0.0, 1e6},
                  "[s] at a real-time rate, pairs later than this are skipped");
    visitor.field("depth", depth, "read depth images also beside a right camera");
    visitor.field("labels", labels, "read label images");
  }
};

}  // namespace km
