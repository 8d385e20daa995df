#pragma once

#include "modules/core/config.hpp"

namespace km {

/// Parameters of FeatureTracker.
struct TrackerConfig {
  static constexpr const char* kSection = "tracker";

  int max_features = 180;
  int min_distance_px = 20;
  int fast_threshold = 12;
  int window_px = 15;
  int pyramid_levels = 2;
  double max_forward_backward_px = 1.0;
  double max_epipolar_px = 1.5;
  double max_reprojection_px = 1.5;
  double min_depth_m = 0.3;
  int seed = 1;

  void visit_fields(auto& visitor) {
    visitor.field("max_features", max_features, {1, 5000},
                  "in one image; more cost time in proportion here and in the smoother");
    visitor.field("min_distance_px", min_distance_px, {4, 200},
                  "[px] between features of one image: how evenly they cover it");
    visitor.field("fast_threshold", fast_threshold, {1, 100},
                  "[grey levels] lowest FAST threshold tried; lower in dim or blurred images, "
                  "higher in noise");
    visitor.field("window_px", window_px, {5, 41}, "[px] side of the square that is tracked, odd");
    visitor.field("pyramid_levels", pyramid_levels, {1, 6},
                  "above the full image; the reach of a search doubles with each");
    visitor.field("max_forward_backward_px", max_forward_backward_px, {0.0, 10.0},
                  "[px] a feature tracked forward and back must return this close; 0: no check");
    visitor.field(
        "max_epipolar_px", max_epipolar_px, {0.1, 20.0},
        "[px] of a right image point from its epipolar line; calibration errors show up here");
    visitor.field("max_reprojection_px", max_reprojection_px, {0.1, 50.0},
                  "[px] from where the motion common to all features puts one");
    visitor.field("min_depth_m", min_depth_m, {0.02, 10.0},
                  "[m] nearest searched in stereo, or believed of a depth image");
    visitor.field("seed", seed, {0, 2147483647}, "of the random samples");
  }
};

}  // namespace km
