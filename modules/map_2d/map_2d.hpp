#pragma once

#include <span>

#include "modules/core/geometry/geometry.hpp"
#include "modules/core/map/label_palette.hpp"
#include "modules/core/map/occupancy_grid.hpp"
#include "modules/map_2d/map_2d_config.hpp"
#include "modules/map_2d/view_rays.hpp"
#include "modules/mesh/labelled_mesh.hpp"

namespace km {

/// Input of make_map_2d().
struct Map2dInput {
  const LabelledMesh& mesh;     ///< In a frame with z up, as `world` is.
  const LabelPalette& palette;  ///< Names of the labels of `mesh`.
  std::span<const ViewRays> views = {};
  /// Transforms of the odometry frame as it was at each keyframe, T_world_kf * T_odom_kf^-1. Views
  /// by later keyframes are left out.
  std::span<const SE3> T_world_odom = {};
};

/// Largest number of cells, 1 B each in files and about 24 B in memory while the map is made.
inline constexpr int kMaxMap2dCells = 16'000'000;

enum class Map2dStatus {
  kMade,
  kEmpty,     ///< The mesh has no faces, or no floor is found.
  kTooLarge,  ///< More than kMaxMap2dCells cells.
};

struct [[nodiscard]] Map2dResult {
  Map2dStatus status = Map2dStatus::kEmpty;
  OccupancyGrid grid;         ///< In the frame of the mesh, without its anchor; empty unless kMade.
  double cells_needed = 0.0;  ///< Cells of the whole mesh.
};

/// Free, occupied and unknown cells of a band of heights above the floor.
///
/// Occupied: surface in the band, unless it is labelled as floor, and steps of the floor above
/// max_step_m. Free: other cells in which floor was seen, or which rays of the views cross within
/// the lowest max_step_m of the band (by the traversal of Amanatides and Woo, "A Fast Voxel
/// Traversal Algorithm for Ray Tracing", 1987). Unknown: the rest. For the floor see find_floor().
///
/// Deterministic. Time proportional to the surface of the mesh and the length of the rays.
[[nodiscard]] Map2dResult make_map_2d(const Map2dConfig& config, const Map2dInput& input);

}  // namespace km
