#pragma once

#include "modules/core/config.hpp"

namespace km {

/// Parameters of sharing meshes between robots. Field names are the YAML keys below `mesh_chunks:`.
struct MeshChunksConfig {
  static constexpr const char* kSection = "mesh_chunks";

  /// Send the own optimised mesh to the others.
  bool publish = false;

  /// Hold the meshes that the others send.
  bool collect = false;

  /// Edge of the cells that a mesh is sent by [m]. What is seen again is sent again cell by cell.
  double cell_m = 2.0;

  /// Positions are rounded to multiples of this [m]. Cells of cell_m must be longer, and shorter
  /// than 21,845 times this: see split_mesh(). The bounds see to both.
  double position_step_m = 0.001;

  /// A cell is sent again when a vertex of it moved by more than this along an axis [m].
  double min_move_m = 0.01;

  /// Bytes of chunks that leave in a second, on average; once per message, not per receiver.
  double max_bytes_per_s = 50000.0;

  void visit_fields(auto& visitor) {
    visitor.field("publish", publish, "send the optimised mesh to the other robots");
    visitor.field("collect", collect, "hold the meshes of the other robots");
    visitor.field("cell_m", cell_m, {0.1, 20.0}, "[m] edge of a cell");
    visitor.field("position_step_m", position_step_m, {0.001, 0.05}, "[m] rounding of positions");
    visitor.field("min_move_m", min_move_m, {0.0, 100.0}, "[m] of a vertex, to send again");
    visitor.field("max_bytes_per_s", max_bytes_per_s, {1000.0, 1e9}, "[B/s] sent, on average");
  }
};

}  // namespace km
