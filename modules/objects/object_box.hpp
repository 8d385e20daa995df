#pragma once

#include <Eigen/Core>
#include <array>
#include <span>

#include "modules/core/geometry/geometry.hpp"

namespace km {

/// Upright box: its z axis is the vertical of the frame, which has z up. By convention size_m.x >=
/// size_m.y, and yaw_rad, the direction of the longer horizontal side, is in [-pi/2, pi/2).
struct ObjectBox {
  Eigen::Vector3d center = Eigen::Vector3d::Zero();  ///< [m]
  double yaw_rad = 0.0;                              ///< About z.
  Eigen::Vector3d size_m = Eigen::Vector3d::Zero();  ///< Along the sides of the box.

  [[nodiscard]] double volume_m3() const { return size_m.prod(); }
  /// This box, larger by `margin_m` on every side.
  [[nodiscard]] ObjectBox grown(double margin_m) const;
  /// Pose of the box: origin in its centre, axes along its sides.
  [[nodiscard]] SE3 pose() const;
};

/// The box of this size at this pose, made upright: only the heading of its x axis counts.
[[nodiscard]] ObjectBox upright_box(const SE3& T_world_box, const Eigen::Vector3d& size_m);

/// The upright box of least base area that contains all points. One side of such a box is along an
/// edge of the convex hull (Freeman and Shapira, "Determining the minimum-area encasing rectangle
/// for an arbitrary closed curve", CACM 1975). Precondition: there is a point. n log n, and
/// quadratic in the corners of the hull.
[[nodiscard]] ObjectBox enclosing_box(std::span<const Eigen::Vector3d> points);

/// The eight corners of a box.
[[nodiscard]] std::array<Eigen::Vector3d, 8> corners_of(const ObjectBox& box);

/// Volume that two boxes share [m^3].
[[nodiscard]] double shared_volume_m3(const ObjectBox& a, const ObjectBox& b);

/// Shared volume divided by the volume of the union; 0 for boxes without volume.
[[nodiscard]] double intersection_over_union(const ObjectBox& a, const ObjectBox& b);

}  // namespace km
