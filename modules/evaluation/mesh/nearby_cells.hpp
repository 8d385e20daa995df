#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <span>
#include <unordered_set>

namespace km {

/// The space near a set of points, in cubic cells: holds all that is within `reach_m` of a point,
/// and nothing further than 2 sqrt(3) reach_m. Cheap to ask; O(volume / reach^3) memory.
class NearbyCells {
 public:
  /// Throws std::invalid_argument unless reach_m is positive and finite.
  explicit NearbyCells(double reach_m);

  void add(std::span<const Eigen::Vector3f> points);

  [[nodiscard]] bool contains(const Eigen::Vector3f& point) const;

  /// False only if nothing in the box is near. May be true for a large box with nothing near in it.
  [[nodiscard]] bool may_touch(const Eigen::AlignedBox3f& box) const;

 private:
  using Cell = std::array<std::int64_t, 3>;

  [[nodiscard]] Cell cell_of(const Eigen::Vector3f& point) const;

  double per_m_;
  Eigen::AlignedBox3f bounds_;  // of the points, widened by the reach
  std::unordered_set<std::uint64_t> cells_;
};

}  // namespace km
