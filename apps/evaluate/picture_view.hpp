#pragma once

#include <Eigen/Geometry>
#include <string>

#include "modules/core/geometry/geometry.hpp"
#include "modules/mesh/labelled_mesh.hpp"

namespace km {

/// Projection of a picture. Camera axes: x to the right, y down, z away from the viewer. Pixel (i,
/// j) covers [i, i + 1) x [j, j + 1).
struct PictureView {
  int width = 0;   ///< [px]
  int height = 0;  ///< [px]
  SE3 T_cam_world = SE3::Identity();
  bool perspective = false;
  double scale = 1.0;  ///< Parallel: [px/m]; perspective: focal length [px].

  /// Column and row [px], and depth along z [m], of a point of the world. In perspective they are
  /// meaningful only for a positive depth.
  [[nodiscard]] Eigen::Vector3d project(const Eigen::Vector3d& point) const;

  /// The point of the world at a pixel and depth.
  [[nodiscard]] Eigen::Vector3d unproject(double column, double row, double depth_m) const;

  /// Direction from the viewer through the pixel; of length one, in the world.
  [[nodiscard]] Eigen::Vector3d ray(double column, double row) const;

  /// This view with `factor` times as many pixels in both directions.
  [[nodiscard]] PictureView enlarged(int factor) const;
};

/// Bounding box of a mesh without the outermost 0.2 % of its vertices in each direction, so that a
/// few stray vertices do not make the picture small. Empty for an empty mesh.
[[nodiscard]] Eigen::AlignedBox3d extent_of(const LabelledMesh& mesh);

/// The view that `text` names:
///   top       from above, x to the right, y up
///   front     from -y, x to the right, z up
///   oblique   from above, south-west and 40 degrees up
///   x,y,z,yaw,pitch       perspective from (x, y, z) [m]; yaw 0 looks along x, 90 along y, pitch
///                         below 0 looks down [deg]; 80 degrees wide
/// The first three fill the picture with `extent`. Throws CLI::ValidationError for other text.
[[nodiscard]] PictureView parse_view(const std::string& text, const Eigen::AlignedBox3d& extent,
                                     int width, int height);

}  // namespace km
