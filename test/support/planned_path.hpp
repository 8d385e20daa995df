#pragma once

#include "modules/core/map/occupancy_grid.hpp"
#include "test/support/test.hpp"

namespace km {

/// The shortest path through free cells with no occupied one within 0.2 m, by A*; empty if there is
/// none.
inline std::vector<Eigen::Vector2d> planned_path(const OccupancyGrid& grid,
                                                 const Eigen::Vector2d& from,
                                                 const Eigen::Vector2d& to) {
  using Cell = std::array<int, 2>;
  const auto cell_at = [&](const Eigen::Vector2d& p) {
    const Eigen::Vector2i cell = ((p - grid.origin) / grid.resolution_m).cast<int>();
    return Cell{cell.x(), cell.y()};
  };
  const auto point_of = [&](const Cell& cell) -> Eigen::Vector2d {
    return grid.origin + grid.resolution_m * Eigen::Vector2d(cell[0] + 0.5, cell[1] + 0.5);
  };
  const auto is_usable = [&](const Cell& cell) {
    bool usable = grid.at(point_of(cell)) == OccupancyGrid::kFree;
    for (int x = -4; x <= 4; ++x)
      for (int y = -4; y <= 4; ++y)
        usable =
            usable && grid.at(point_of({cell[0] + x, cell[1] + y})) != OccupancyGrid::kOccupied;
    return usable;
  };
  const Cell start = cell_at(from), goal = cell_at(to);
  std::map<Cell, std::pair<double, Cell>> best{{start, {0.0, start}}};  // length, predecessor
  std::set<std::pair<double, Cell>> open{{0.0, start}};
  while (!open.empty() && open.begin()->second != goal) {
    const Cell cell = open.extract(open.begin()).value().second;
    for (int k = 0; k < 9; ++k) {
      const Cell next{cell[0] + k % 3 - 1, cell[1] + k / 3 - 1};
      const double length = best[cell].first + (point_of(next) - point_of(cell)).norm();
      if (!is_usable(next) || (best.contains(next) && best[next].first <= length)) continue;
      best[next] = {length, cell};
      open.emplace(length + (point_of(next) - point_of(goal)).norm(), next);
    }
  }
  std::vector<Eigen::Vector2d> path;
  if (open.empty()) return path;
  for (Cell cell = goal; cell != start; cell = best[cell].second) path.push_back(point_of(cell));
  return path;
}

}  // namespace km
