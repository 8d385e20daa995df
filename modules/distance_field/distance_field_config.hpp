#pragma once

#include "modules/core/config.hpp"

namespace km {

/// Parameters of the distance field.
struct DistanceFieldConfig {
  static constexpr const char* kSection = "distance_field";

  bool enabled = false;
  double max_distance_m = 2.0;

  void visit_fields(auto& visitor) {
    visitor.field(
        "enabled", enabled,
        "computes distances to the nearest surface in the window of the map, for planners");
    visitor.field("max_distance_m", max_distance_m, {0.1, 10.0},
                  "[m] larger distances are not computed; must not exceed 100 voxels; "
                  "larger values take longer");
  }
};

}  // namespace km
