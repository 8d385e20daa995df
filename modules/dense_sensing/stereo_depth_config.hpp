#pragma once

#include "modules/core/config.hpp"

namespace km {

/// Parameters of StereoDepth.
struct StereoDepthConfig {
  static constexpr const char* kSection = "stereo_depth";

  int downscale = 1;
  double min_depth_m = 0.6;
  double max_depth_m = 12.0;
  int block_px = 5;
  int uniqueness_percent = 8;
  int max_left_right_px = 1;
  int speckle_px = 300;

  void visit_fields(auto& visitor) {
    visitor.field("downscale", downscale, {1, 4},
                  "factor by which depth images are narrower and lower than the camera's; with 2, "
                  "EuRoC's images need a fifth of the time for about the same accuracy, with less "
                  "detail and less noise");
    visitor.field("min_depth_m", min_depth_m, {0.1, 10.0},
                  "[m] smallest depth that is searched; the time is proportional to the number of "
                  "disparities, focal length * baseline / min_depth_m");
    visitor.field("max_depth_m", max_depth_m, {0.5, 65.0}, "[m] largest depth that is used");
    visitor.field("block_px", block_px, {1, 11},
                  "[px of the depth image] side of the compared blocks, odd");
    visitor.field("uniqueness_percent", uniqueness_percent, {0, 50},
                  "[percent] margin by which the best match must be better than all others");
    visitor.field("max_left_right_px", max_left_right_px, {0, 10},
                  "[px] largest difference from the disparity matched from the right image");
    visitor.field(
        "speckle_px", speckle_px, {0, 10000},
        "[px] smaller areas of similar depth are dropped as wrong matches; 0: no area is dropped");
  }
};

}  // namespace km
