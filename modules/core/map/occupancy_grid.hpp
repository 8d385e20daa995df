#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "modules/core/ids.hpp"

namespace km {

/// A horizontal grid of free and occupied cells, as in nav_msgs/OccupancyGrid. Cell (0, 0) has its
/// corner of lowest x and y at `origin`.
struct OccupancyGrid {
  static constexpr std::int8_t kUnknown = -1, kFree = 0, kOccupied = 100;

  double resolution_m = 0.05;                        ///< Side of a cell.
  Eigen::Vector2d origin = Eigen::Vector2d::Zero();  ///< [m] in the frame of the map
  int width = 0;                                     ///< [cells] along x
  int height = 0;                                    ///< [cells] along y
  std::vector<std::int8_t> cells;                    ///< Row-major: x + width * y.
  double z_m = 0.0;    ///< Median height of the floor, in the frame of the map.
  RobotId anchor = 0;  ///< Robot whose odometry frame is the frame of the map.

  [[nodiscard]] bool empty() const { return cells.empty(); }

  [[nodiscard]] bool contains(int x, int y) const {
    return x >= 0 && y >= 0 && x < width && y < height;
  }

  /// Precondition: contains(x, y).
  [[nodiscard]] std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(x) +
           static_cast<std::size_t>(width) * static_cast<std::size_t>(y);
  }

  /// Value at a point [m]; kUnknown outside.
  [[nodiscard]] std::int8_t at(const Eigen::Vector2d& point) const {
    const Eigen::Vector2d cell = ((point - origin) / resolution_m).array().floor();
    if (!(cell.x() >= 0 && cell.y() >= 0 && cell.x() < width && cell.y() < height)) return kUnknown;
    return cells[index(static_cast<int>(cell.x()), static_cast<int>(cell.y()))];
  }
};

}  // namespace km
