#pragma once

#include "modules/core/config.hpp"

namespace km {

/// Parameters of FeatureTracker.
struct TrackerConfig {
  static constexpr const char* kSection = "tracker";

  int max_features = 180;
  int min_distance_px = 20;
  int fast_threshold = 12;
  double max_epipolar_px = 1.5;
  double min_depth_m = 0.3;
  double readout_s = 0.0;

  void visit_fields(auto& visitor) {
    visitor.field("max_features", max_features, {1, 5000},
                  "largest number of features in one image; the time of tracker and smoother is "
                  "proportional to it");
    visitor.field("min_distance_px", min_distance_px, {4, 200},
                  "[px] smallest distance between features of one image; larger values spread them "
                  "more evenly");
    visitor.field("fast_threshold", fast_threshold, {1, 100},
                  "[grey levels] lowest FAST threshold; lower for dim or blurred images, higher "
                  "for noisy ones");
    visitor.field("max_epipolar_px", max_epipolar_px, {0.1, 20.0},
                  "[px] largest distance of a right image point from its epipolar line; larger for "
                  "an imprecise calibration");
    visitor.field(
        "min_depth_m", min_depth_m, {0.02, 10.0},
        "[m] smallest depth: of the stereo search, and of values of a depth image that are used");
    visitor.field(
        "readout_s", readout_s, {0.0, 0.1},
        "[s] time from the first to the last row of an image with a rolling shutter, whose "
        "stamp is that of the middle row; 0: global shutter, or unknown (see "
        "vio.calibration_readout_s)");
  }
};

}  // namespace km
