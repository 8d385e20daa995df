#pragma once

#include "modules/core/config.hpp"

namespace km {

/// Parameters of sharing meshes between robots.
struct MeshChunksConfig {
  static constexpr const char* kSection = "mesh_chunks";

  bool publish = false;
  bool collect = false;
  double cell_m = 2.0;
  double position_step_m = 0.001;
  double min_move_m = 0.01;
  double max_bytes_per_s = 50000.0;

  void visit_fields(auto& visitor) {
    visitor.field("publish", publish, "publish the robot's optimised mesh for the other robots");
    visitor.field("collect", collect, "store the meshes of the other robots");
    visitor.field(
        "cell_m", cell_m, {0.1, 20.0},
        "[m] side of the cells of a mesh; a changed part of the mesh is sent again cell by cell");
    visitor.field("position_step_m", position_step_m, {0.001, 0.05},
                  "[m] positions are rounded to multiples of this; cells must be longer, and "
                  "shorter than 21,845 times this (see split_mesh()), which the bounds ensure");
    visitor.field("min_move_m", min_move_m, {0.0, 100.0},
                  "[m along an axis] motion of a vertex after which its cell is sent again");
    visitor.field("max_bytes_per_s", max_bytes_per_s, {1000.0, 1e9},
                  "[B/s] average rate of sent chunks; counted once per message, not per receiver");
  }
};

}  // namespace km
