#pragma once

#include "modules/core/config.hpp"

namespace km {

/// Parameters of the search for places by constellations of objects.
struct ConstellationsConfig {
  static constexpr const char* kSection = "constellations";

  bool on = false;
  double radius_m = 25.0;

  void visit_fields(auto& visitor) {
    visitor.field("on", on,
                  "find places that two robots have in common by the objects of their maps, also "
                  "from opposite directions; needs objects.on, and this key on both robots, "
                  "because the messages with objects then state poses of odometry");
    visitor.field("radius_m", radius_m, {2.0, 500.0},
                  "[m] objects within this distance of a keyframe are matched together; small "
                  "enough that odometry drifts little within it, large enough for ten objects");
  }
};

}  // namespace km
