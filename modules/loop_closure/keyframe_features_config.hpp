#pragma once

#include "modules/core/config.hpp"

namespace km {

/// Parameters of KeyframeFeatureExtractor. Field names are the YAML keys below
/// `keyframe_features:`.
struct KeyframeFeaturesConfig {
  static constexpr const char* kSection = "keyframe_features";

  /// Keypoints kept per keyframe, spread evenly over the left image. Another robot that asks for the
  /// keyframe gets loop_closure.reply_keypoints of them at most.
  int max_keypoints = 1000;

  /// Smallest contrast of a corner [grey levels]. Lower finds more points in dim scenes.
  int min_contrast = 7;

  /// Depths that stereo or a depth image is trusted with, along the optical axis [m].
  double min_depth_m = 0.4;
  double max_depth_m = 40.0;

  /// Least zero-normalised cross-correlation of the two patches of a stereo match.
  double min_stereo_correlation = 0.8;

  void visit_fields(auto& visitor) {
    visitor.field("max_keypoints", max_keypoints, {50, 4000}, "per keyframe");
    visitor.field("min_contrast", min_contrast, {2, 100}, "[grey levels] of a corner");
    visitor.field("min_depth_m", min_depth_m, {0.05, 10.0}, "[m] nearest trusted");
    visitor.field("max_depth_m", max_depth_m, {1.0, 1000.0}, "[m] farthest trusted");
    visitor.field("min_stereo_correlation", min_stereo_correlation, {0.0, 0.99},
                  "of left and right patch");
  }
};

}  // namespace km
