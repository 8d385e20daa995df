#pragma once

#include "modules/core/config.hpp"

namespace km {

/// Parameters of the playback of recorded pose graphs.
struct GraphPlaybackConfig {
  static constexpr const char* kSection = "graph_playback";

  double poses_per_second = 1.0;

  void visit_fields(auto& visitor) {
    visitor.field("poses_per_second", poses_per_second, {1e-3, 1e6},
                  "[1/s] keyframe rate of graphs without times (g2o, CSV): keyframe i is stamped i "
                  "/ poses_per_second");
  }
};

}  // namespace km
