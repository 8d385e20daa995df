#pragma once

#include <string>

#include "modules/core/config.hpp"

namespace km {

/// Parameters of KeyframeFeatureExtractor.
struct KeyframeFeaturesConfig {
  static constexpr const char* kSection = "keyframe_features";

  int max_keypoints = 1000;
  int min_contrast = 7;
  double min_depth_m = 0.4;
  double max_depth_m = 40.0;
  std::string network = "networks/keypoints.onnx";

  void visit_fields(auto& visitor) {
    visitor.field("max_keypoints", max_keypoints, {50, 4000},
                  "maximum number of keypoints of a keyframe, evenly spread over the left image; "
                  "other robots receive fewer, see loop_closure.reply_keypoints");
    visitor.field("min_contrast", min_contrast, {2, 100},
                  "[grey levels] smallest contrast of a corner; lower: more corners in dim scenes");
    visitor.field(
        "min_depth_m", min_depth_m, {0.05, 10.0},
        "[m] smallest depth that is used, along the optical axis, from stereo or a depth image");
    visitor.field("max_depth_m", max_depth_m, {1.0, 1000.0}, "[m] largest depth that is used");
    visitor.field(
        "network", network,
        "ONNX file of a network that describes keypoints, by which keyframes of two robots are "
        "matched if both have this file, otherwise by ORB; networks/keypoints.onnx comes with the "
        "program; empty: ORB");
  }
};

}  // namespace km
