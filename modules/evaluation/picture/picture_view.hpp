#pragma once

#include <Eigen/Geometry>
#include <string>

#include "modules/core/geometry.hpp"
#include "modules/mesh/labelled_mesh.hpp"

namespace km {

/// How a picture sees the world. Camera axes: x to the right, y down, z away from the viewer. Pixel
/// (i, j) covers [i, i + 1) x [j, j + 1).
struct PictureView {
  int width = 0;   ///< [px]
  int height = 0;  ///< [px]
  SE3 T_cam_world = SE3::Identity();
  bool perspective = false;
  double scale = 1.0;  ///< Parallel: [px/m]; perspective: focal length [px].

  /// Column and row [px], and depth along z [m], of a point of the world. Perspective: meaningless
  /// unless the depth is positive.
  [[nodiscard]] Eigen::Vector3d project(const Eigen::Vector3d& point) const;

  /// The point of the world there.
  [[nodiscard]] Eigen::Vector3d unproject(double column, double row, double depth_m) const;

  /// From the viewer to what is seen there; of length one, in the world.
  [[nodiscard]] Eigen::Vector3d ray(double column, double row) const;

  /// The same view with `factor` as many pixels each way.
  [[nodiscard]] PictureView enlarged(int factor) const;
};

/// Where a mesh is, but for the outermost 0.2 % of its vertices each way: a few stray ones do not
/// make all the rest small. Empty for an empty mesh.
[[nodiscard]] Eigen::AlignedBox3d extent_of(const LabelledMesh& mesh);

/// The view that `text` names:
///   top       from above, x to the right, y up
///   front     from -y, x to the right, z up
///   oblique   from above, south-west and 40 degrees up
///   x,y,z,yaw,pitch       perspective from (x, y, z) [m]; yaw 0 looks along x, 90 along y, pitch
///                         below 0 looks down [deg]; 80 degrees wide
///   x,y,z,qx,qy,qz,qw     likewise, from the pose of a camera whose z looks forward, y down
/// The first three fill the picture with `extent`. Throws std::invalid_argument for other text.
[[nodiscard]] PictureView parse_view(const std::string& text, const Eigen::AlignedBox3d& extent,
                                     int width, int height);

}  // namespace km
