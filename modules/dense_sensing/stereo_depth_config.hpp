#pragma once

#include "modules/core/config.hpp"

namespace km {

/// Parameters of StereoDepth. Field names are the YAML keys below `stereo_depth:`.
struct StereoDepthConfig {
  static constexpr const char* kSection = "stereo_depth";

  /// Depth images are so many times narrower and lower than the camera's. At 2, EuRoC's cameras
  /// take a fifth of the time for about the same accuracy: less detail, less noise.
  int downscale = 1;

  /// Depths that are searched. Nearer takes longer: the number of disparities is
  /// focal length * baseline / min_depth_m.
  double min_depth_m = 0.6;
  double max_depth_m = 12.0;

  /// Side of the blocks compared [px of the depth image], odd.
  int block_px = 5;

  /// The best match must beat all others by so many percent.
  int uniqueness_percent = 8;

  /// Matched from the right image the disparity must be the same to so many pixels.
  int max_left_right_px = 1;

  /// Areas of similar depth smaller than so many pixels are taken for wrong matches; 0: none.
  int speckle_px = 300;

  void visit_fields(auto& visitor) {
    visitor.field("downscale", downscale, {1, 4}, "of the depth image's sides");
    visitor.field("min_depth_m", min_depth_m, {0.1, 10.0}, "[m] nearest that is searched");
    visitor.field("max_depth_m", max_depth_m, {0.5, 65.0}, "[m] farthest that is used");
    visitor.field("block_px", block_px, {1, 11}, "[px] side of the blocks compared, odd");
    visitor.field("uniqueness_percent", uniqueness_percent, {0, 50}, "best before all others");
    visitor.field("max_left_right_px", max_left_right_px, {0, 10}, "[px] matched both ways");
    visitor.field("speckle_px", speckle_px, {0, 10000}, "[px] smaller areas are dropped; 0: none");
  }
};

}  // namespace km
