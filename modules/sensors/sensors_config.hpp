#pragma once

#include <optional>

#include "modules/core/config.hpp"

namespace km {

/// Parameters of reading and playing a recording.
struct SensorsConfig {
  static constexpr const char* kSection = "sensors";

  std::optional<double> stereo_tolerance_s;
  int read_ahead = 8;
  double max_lag_s = 0.5;
  bool depth = false;
  bool labels = false;

  void visit_fields(auto& visitor) {
    visitor.field("stereo_tolerance_s", stereo_tolerance_s, {0.0, 0.1},
                  "[s] largest difference between the stamps of left and right; none: it follows "
                  "from the first stamps, as does a constant difference");
    visitor.field("read_ahead", read_ahead, {1, 1000},
                  "stereo pairs decoded ahead of the one being published, so that nobody waits");
    visitor.field(
        "max_lag_s", max_lag_s, {0.0, 1e6},
        "[s] how late odometry may be before images are left out: at half of this the map "
        "gets no new frames, from here on odometry gets every second image, then every "
        "third and fourth; at twice this a recording's clock waits, and live images are "
        "dropped. Inertial samples are kept");
    visitor.field("depth", depth,
                  "read depth images also beside a right camera; an RGB-D rig always reads them");
    visitor.field("labels", labels, "read label images");
  }
};

}  // namespace km
