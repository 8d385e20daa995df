#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "modules/core/camera/camera.hpp"
#include "modules/core/geometry/geometry.hpp"
#include "modules/core/geometry/pose_spacing.hpp"
#include "modules/core/ids.hpp"
#include "modules/core/map/dense_frame.hpp"

namespace km {

/// Free space that one depth image shows: segments from the camera to points on surface. They are
/// stored in the odometry frame with the keyframe of the image. So T_world_kf * T_odom_kf^-1 of the
/// keyframe moves them when its pose is corrected.
struct ViewRays {
  KeyframeIndex keyframe = 0;
  Eigen::Vector3f origin = Eigen::Vector3f::Zero();  ///< In the odometry frame [m].
  std::vector<Eigen::Vector3f> ends;                 ///< In the odometry frame [m].
};

/// Thins each depth image to about 1100 rays. Only images from a new place or in a new direction
/// are kept: 13 kB for each 0.3 m or 15 degrees of motion. Not thread-safe.
class RayThinner {
 public:
  /// Depths beyond `max_range_m` become rays of that length. `camera` takes the images.
  RayThinner(const Camera& camera, double max_range_m);

  /// Rays of an image; nullopt if the camera has moved too little since the last rays, or the image
  /// has another size than the camera's.
  [[nodiscard]] std::optional<ViewRays> add(const DenseFrame& frame);

 private:
  struct Bearing {
    std::size_t pixel = 0;
    Eigen::Vector2d at = Eigen::Vector2d::Zero();  // on the plane z = 1 of the camera
  };

  std::size_t pixels_ = 0;
  double max_range_m_;
  std::vector<Bearing> bearings_;
  PoseSpacing spacing_;
};

}  // namespace km
