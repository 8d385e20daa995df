#include "modules/evaluation/mesh/nearby_cells.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace km {
namespace {

constexpr int kBits = 21;  // of each coordinate in a key: two million cells along each axis
constexpr std::int64_t kMaxCells = 64;  // of a box, above which it is not looked into

std::uint64_t key_of(const std::array<std::int64_t, 3>& cell) {
  std::uint64_t key = 0;
  for (const std::int64_t index : cell)
    key = key << kBits | (static_cast<std::uint64_t>(index) & ((1U << kBits) - 1));
  return key;
}

// Calls `use` for the cells from `low` to `high` until it returns true; whether it did.
template <typename Use>
bool any_cell(const std::array<std::int64_t, 3>& low, const std::array<std::int64_t, 3>& high,
              const Use& use) {
  for (std::int64_t x = low[0]; x <= high[0]; ++x)
    for (std::int64_t y = low[1]; y <= high[1]; ++y)
      for (std::int64_t z = low[2]; z <= high[2]; ++z)
        if (use(key_of({x, y, z}))) return true;
  return false;
}

}  // namespace

NearbyCells::NearbyCells(double reach_m) : per_m_(1.0 / reach_m) {
  if (!(reach_m > 0.0) || !std::isfinite(reach_m))
    throw std::invalid_argument("a reach of " + std::to_string(reach_m) + " m");
}

NearbyCells::Cell NearbyCells::cell_of(const Eigen::Vector3f& point) const {
  Cell cell;
  for (int axis = 0; axis < 3; ++axis)
    cell[static_cast<std::size_t>(axis)] =
        static_cast<std::int64_t>(std::floor(static_cast<double>(point[axis]) * per_m_));
  return cell;
}

void NearbyCells::add(std::span<const Eigen::Vector3f> points) {
  const auto reach = static_cast<float>(1.0 / per_m_);
  std::unordered_set<std::uint64_t> done;
  for (const Eigen::Vector3f& point : points) {
    const Cell cell = cell_of(point);
    bounds_.extend(point - Eigen::Vector3f::Constant(reach));
    bounds_.extend(point + Eigen::Vector3f::Constant(reach));
    if (!done.insert(key_of(cell)).second) continue;
    const auto insert = [&](std::uint64_t key) {
      cells_.insert(key);
      return false;
    };
    any_cell({cell[0] - 1, cell[1] - 1, cell[2] - 1}, {cell[0] + 1, cell[1] + 1, cell[2] + 1},
             insert);
  }
}

bool NearbyCells::contains(const Eigen::Vector3f& point) const {
  return bounds_.contains(point) && cells_.contains(key_of(cell_of(point)));
}

bool NearbyCells::may_touch(const Eigen::AlignedBox3f& box) const {
  const Eigen::AlignedBox3f common = bounds_.intersection(box);
  if (common.isEmpty()) return false;
  const Cell low = cell_of(common.min());
  const Cell high = cell_of(common.max());
  const std::int64_t count =
      (high[0] - low[0] + 1) * (high[1] - low[1] + 1) * (high[2] - low[2] + 1);
  if (count > kMaxCells) return true;
  return any_cell(low, high, [&](std::uint64_t key) { return cells_.contains(key); });
}

}  // namespace km
