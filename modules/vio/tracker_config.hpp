#pragma once

#include "modules/core/config.hpp"

namespace km {

/// Parameters of FeatureTracker. Field names are the YAML keys below `tracker:`.
struct TrackerConfig {
  static constexpr const char* kSection = "tracker";

  /// Features kept in one image at most. More cost time in proportion here and in the smoother.
  int max_features = 180;

  /// Smallest distance between two features of one image [px]: how evenly they cover it.
  int min_distance_px = 20;

  /// Lowest FAST threshold tried [grey levels]. Lower in dim or blurred images, higher in noise.
  int fast_threshold = 12;

  /// Side of the square window that is tracked [px], odd.
  int window_px = 15;

  /// Pyramid levels above the full image; the reach of a search doubles with each.
  int pyramid_levels = 2;

  /// A feature tracked forward and back must return this close to its start [px]; 0 leaves the
  /// check out.
  double max_forward_backward_px = 1.0;

  /// Largest distance of a right image point from its epipolar line [px]. Calibration errors show
  /// up here.
  double max_epipolar_px = 1.5;

  /// Largest distance of a feature from where the motion common to all features puts it [px].
  double max_reprojection_px = 1.5;

  /// Nearest depth searched in stereo, or believed of a depth image [m].
  double min_depth_m = 0.3;

  /// Seed of the random samples.
  int seed = 1;

  void visit_fields(auto& visitor) {
    visitor.field("max_features", max_features, {1, 5000}, "in one image");
    visitor.field("min_distance_px", min_distance_px, {4, 200}, "[px] between features");
    visitor.field("fast_threshold", fast_threshold, {1, 100}, "[grey levels] of new corners");
    visitor.field("window_px", window_px, {5, 41}, "[px] side, odd");
    visitor.field("pyramid_levels", pyramid_levels, {1, 6}, "above the full image");
    visitor.field("max_forward_backward_px", max_forward_backward_px, {0.0, 10.0},
                  "[px] 0: no check");
    visitor.field("max_epipolar_px", max_epipolar_px, {0.1, 20.0}, "[px] of right image points");
    visitor.field("max_reprojection_px", max_reprojection_px, {0.1, 50.0},
                  "[px] from the common motion");
    visitor.field("min_depth_m", min_depth_m, {0.02, 10.0}, "[m] nearest in stereo");
    visitor.field("seed", seed, {0, 2147483647}, "of the random samples");
  }
};

}  // namespace km
