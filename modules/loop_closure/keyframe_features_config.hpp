#pragma once

#include "modules/core/config.hpp"

namespace km {

/// Parameters of KeyframeFeatureExtractor.
struct KeyframeFeaturesConfig {
  static constexpr const char* kSection = "keyframe_features";

  int max_keypoints = 1000;
  int min_contrast = 7;
  double min_depth_m = 0.4;
  double max_depth_m = 40.0;
  double min_stereo_correlation = 0.8;

  void visit_fields(auto& visitor) {
    visitor.field("max_keypoints", max_keypoints, {50, 4000},
                  "kept per keyframe, spread evenly over the left image; other robots are sent "
                  "loop_closure.reply_keypoints of them at most");
    visitor.field("min_contrast", min_contrast, {2, 100},
                  "[grey levels] smallest of a corner; lower finds more in dim scenes");
    visitor.field(
        "min_depth_m", min_depth_m, {0.05, 10.0},
        "[m along the optical axis] nearest that stereo or a depth image is trusted with");
    visitor.field("max_depth_m", max_depth_m, {1.0, 1000.0}, "[m] farthest trusted");
    visitor.field("min_stereo_correlation", min_stereo_correlation, {0.0, 0.99},
                  "least zero-normalised cross-correlation of left and right patch");
  }
};

}  // namespace km
