#pragma once

#include <string>
#include <vector>

#include "modules/core/config.hpp"

namespace km {

/// Parameters of the 2D map.
struct Map2dConfig {
  static constexpr const char* kSection = "map_2d";

  bool enabled = true;
  double resolution_m = 0.05;
  double min_height_m = 0.10;
  double max_height_m = 1.50;
  double max_step_m = 0.25;
  std::vector<std::string> floor_labels = {"floor",  "ground", "road",   "sidewalk", "lane",
                                           "stairs", "ramp",   "carpet", "terrain"};

  void visit_fields(auto& visitor) {
    visitor.field("enabled", enabled,
                  "makes a 2D map for planners from the mesh, if `mapping` makes one");
    visitor.field("resolution_m", resolution_m, {0.01, 1.0}, "[m] side of a cell");
    visitor.field("min_height_m", min_height_m, {0.0, 10.0},
                  "[m above the floor] lower surface is no obstacle: what the robot drives over");
    visitor.field("max_height_m", max_height_m, {0.05, 100.0},
                  "[m above the floor] higher surface is no obstacle: what the robot drives under");
    visitor.field("max_step_m", max_step_m, {0.01, 10.0},
                  "[m] a higher step between neighbouring cells of the floor is an obstacle");
    visitor.field("floor_labels", floor_labels,
                  "names of palette classes that are floor, stairs and ramps included; without "
                  "such labels in the map, level surface is searched for the floor");
  }
};

}  // namespace km
