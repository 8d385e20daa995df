#pragma once

#include <string>
#include <vector>

#include "modules/core/config.hpp"

namespace km {

/// Parameters of the extraction of objects.
struct ObjectsConfig {
  static constexpr const char* kSection = "objects";

  bool on = true;
  std::vector<std::string> background = {
      "unknown", "sky",  "building", "road",    "ground", "sidewalk", "terrain", "vegetation",
      "tree",    "wall", "floor",    "ceiling", "window", "door",     "curtain", "fence"};
  double gap_m = 0.15;
  double min_surface_m2 = 0.1;
  int min_views = 2;

  void visit_fields(auto& visitor) {
    visitor.field(
        "on", on,
        "extract objects from a mesh with labels, write them to objects.json, exchange them "
        "with the other robots, and find places in common by them; costs nothing without "
        "labels");
    visitor.field("background", background,
                  "names of the classes of the palette whose surfaces are no objects; names that "
                  "the palette lacks do no harm; label 0 is never an object");
    visitor.field("gap_m", gap_m, {0.0, 5.0},
                  "[m] surfaces of one class at most this far apart are one object; larger than a "
                  "voxel, smaller than the distance of neighbouring objects");
    visitor.field("min_surface_m2", min_surface_m2, {0.0, 1e6},
                  "[m^2] smaller surfaces are no objects");
    visitor.field("min_views", min_views, {1, 1000000},
                  "number of keyframes below which a surface is no object");
  }
};

}  // namespace km
