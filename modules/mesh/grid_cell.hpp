#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>

namespace km {

/// A cell of a regular grid.
using GridCell = std::array<std::int64_t, 3>;

struct GridCellHash {
  std::size_t operator()(const GridCell& cell) const noexcept {
    // Large odd factors (of splitmix64 and the like) spread neighbouring cells.
    const auto [x, y, z] = cell;
    std::uint64_t h = static_cast<std::uint64_t>(x) * 0x9E3779B97F4A7C15U;
    h = (h ^ (h >> 29U)) + static_cast<std::uint64_t>(y) * 0xBF58476D1CE4E5B9U;
    h = (h ^ (h >> 32U)) + static_cast<std::uint64_t>(z) * 0x94D049BB133111EBU;
    return h ^ (h >> 31U);
  }
};

/// The cell of `point` on a grid of this width. Precondition: |point| / width < 2^63.
[[nodiscard]] inline GridCell grid_cell(const Eigen::Vector3d& point, double width) {
  const Eigen::Vector3d cell = (point / width).array().floor();
  return {static_cast<std::int64_t>(cell.x()), static_cast<std::int64_t>(cell.y()),
          static_cast<std::int64_t>(cell.z())};
}

}  // namespace km
