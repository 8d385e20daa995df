#pragma once

#include "modules/core/config.hpp"

namespace km {

/// Parameters of the search for places by constellations of objects.
struct ConstellationsConfig {
  static constexpr const char* kSection = "constellations";

  bool on = false;
  double radius_m = 25.0;
  double max_chance = 1e-4;
  double center_noise_m = 0.1;
  double unseen_share = 0.1;

  void visit_fields(auto& visitor) {
    visitor.field("on", on,
                  "find places that two robots have in common by the objects of their maps, also "
                  "from opposite directions; needs objects.on, and this key on both robots, "
                  "because the messages with objects then state poses of odometry");
    visitor.field("radius_m", radius_m, {2.0, 500.0},
                  "[m] objects within this distance of a keyframe are matched together; small "
                  "enough that odometry drifts little within it, large enough for ten objects");
    visitor.field("max_chance", max_chance, {1e-12, 1.0},
                  "largest expected number of equally good matches by chance, per search; smaller: "
                  "fewer false places, and more objects per match");
    visitor.field("center_noise_m", center_noise_m, {0.01, 5.0},
                  "[m] standard deviation of the centre of a box along each axis for an object "
                  "that is seen from all sides; about half a voxel");
    visitor.field(
        "unseen_share", unseen_share, {0.0, 0.5},
        "standard deviation of the shift of the centre of a box, as a share of its sides; "
        "a robot that sees one side of an object shifts it by up to half of the other");
  }
};

}  // namespace km
