#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "modules/core/ids.hpp"

namespace km {

/// Cells of the grid of ChunkGrid in which the corrected mesh of a robot has faces since now. If
/// the anchor differs from that of the cells before, the mesh has left the cells stated before.
struct MeshCells {
  using Cell = std::array<std::int32_t, 3>;
  RobotId anchor = 0;  ///< Robot whose odometry frame is `world`.
  std::vector<Cell> cells;
};

}  // namespace km
