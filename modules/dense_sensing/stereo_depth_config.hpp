#pragma once

#include "modules/core/config.hpp"

namespace km {

/// Parameters of StereoDepth.
struct StereoDepthConfig {
  static constexpr const char* kSection = "stereo_depth";

  int downscale = 1;
  double min_depth_m = 0.3;
  double max_depth_m = 12.0;

  void visit_fields(auto& visitor) {
    visitor.field("downscale", downscale, {1, 4},
                  "factor by which depth images are narrower and lower than the camera's; with 2, "
                  "EuRoC's images need a fifth of the time for about the same accuracy, with less "
                  "detail and less noise");
    visitor.field("min_depth_m", min_depth_m, {0.1, 10.0},
                  "[m] smallest depth that is searched, at most to a disparity of half of the "
                  "image's width; the time is proportional to the largest disparity that an image "
                  "shows");
    visitor.field("max_depth_m", max_depth_m, {0.5, 65.0}, "[m] largest depth that is used");
  }
};

}  // namespace km
