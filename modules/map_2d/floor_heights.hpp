#pragma once

#include <limits>
#include <vector>

#include "modules/map_2d/surface_columns.hpp"

namespace km {

/// Height of the floor in each cell of a grid.
struct FloorHeights {
  static constexpr float kNone = std::numeric_limits<float>::quiet_NaN();

  /// [m]; NaN where no floor is within kReach_m.
  std::vector<float> height_m;
  /// True for a cell in which floor was seen; other heights are those of the nearest such cell.
  std::vector<bool> is_seen;

  /// Largest distance from seen floor at which its height is used.
  static constexpr double kReach_m = 2.0;
};

/// Finds the floor.
///
/// Seeds: cells with surface labelled as floor. If the mesh has none, tiles of 2 m are searched for
/// level surface instead. The height with the most level surface, or the lowest one with at least a
/// fifth as much, is the height of the tile. A raised tile with less than 2 m^2 of surface at its
/// height has no seeds, because it may be a table. Raised means more than `max_step_m` higher than
/// a tile beside it.
///
/// Growth: level surface that continues the floor of the next cell, with a slope up to 45 degrees,
/// is floor. So ramps without labels are floor too, up to the slope of SurfaceKind::kLevel. If the
/// mesh has labels of floor, surface with other labels is floor only at the height of the nearest
/// floor, as a carpet is. Otherwise a wrong slope of the mesh beside a box makes its top floor.
///
/// A grid has one floor. If storeys lie above each other, the lowest one counts.
[[nodiscard]] FloorHeights find_floor(const SurfaceColumns& columns, double max_step_m);

}  // namespace km
