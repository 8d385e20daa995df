#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "modules/core/ids.hpp"
#include "modules/core/occupancy_grid.hpp"
#include "modules/mesh/labelled_mesh.hpp"

namespace km {

enum class RasterKind : std::uint8_t {
  kOccupancy,  ///< 2D map, in `world`.
  kDistances,  ///< Slice of the distance field, in the odometry frame of the sending robot.
};

/// A horizontal grid of values; the newest of its kind counts. Smaller values are nearer to
/// obstacles: where several cells become one, the smallest value remains.
struct ViewRaster {
  /// Value of an occupied cell of a 2D map, and of a point on a surface or behind it.
  static constexpr std::uint8_t kOccupied = 0;
  static constexpr std::uint8_t kFree = 1;  ///< Value of a free cell of a 2D map.
  /// Value of a point at the largest distance of the field; values between are proportional to the
  /// distance. With few values the runs are long.
  static constexpr std::uint8_t kFarthest = 31;
  static constexpr std::uint8_t kUnknown = 255;

  static constexpr std::size_t kMaxCells = std::size_t{1} << 20U;
  static constexpr std::uint32_t kMaxSide = 4096;  ///< [cells] Browsers draw no larger images.

  RasterKind kind = RasterKind::kOccupancy;
  RobotId anchor = 0;  ///< Robot whose odometry frame is `world`; of a slice: the sending robot.
  float resolution_m = 0.05F;               ///< Side of a cell.
  std::array<float, 3> origin = {0, 0, 0};  ///< Corner of cell (0, 0), and height [m].
  std::uint32_t width = 0;                  ///< [cells] along x
  std::uint32_t height = 0;                 ///< [cells] along y
  /// Runs of equal cells, row by row, x first: pairs of a length (1 to 255) and a value.
  std::vector<std::uint8_t> runs = {};
};

/// True if the raster has a size within the bounds, and runs of possible values for all its cells.
[[nodiscard]] bool is_valid(const ViewRaster& raster);

/// Values of the cells, row by row. Precondition: the raster is valid.
[[nodiscard]] std::vector<std::uint8_t> cells_of(const ViewRaster& raster);

/// The 2D map, reduced until it fits into an update: 2 x 2 cells become one. nullopt for an empty
/// map.
[[nodiscard]] std::optional<ViewRaster> view_raster(const OccupancyGrid& map);

/// A slice of the distance field (see DistanceSlice) that `robot` sends, reduced in the same way.
/// nullopt for points without colours, and for points that form no grid.
[[nodiscard]] std::optional<ViewRaster> view_raster(const LabelledMesh& slice, RobotId robot);

}  // namespace km
