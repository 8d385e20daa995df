#pragma once

#include <Eigen/Core>
#include <vector>

#include "modules/core/camera.hpp"

namespace km {

/// Viewing rays of every pixel of a camera, distortion undone: computed once per camera (some 20 ms
/// at 752x480), then shared by all its views. Immutable.
class PixelRays {
 public:
  /// Throws std::invalid_argument for an empty image or a focal length that is not positive.
  explicit PixelRays(const PinholeCamera& camera);

  [[nodiscard]] const PinholeCamera& camera() const { return camera_; }

  /// Bearings of the pixels' centres on the plane z = 1 of the camera frame, row-major, with one
  /// column and one row more than the image, so that differences give each pixel's extent. Where
  /// the distortion has no inverse, the bearing continues the undistorted pinhole.
  [[nodiscard]] const std::vector<Eigen::Vector2f>& bearings() const { return bearings_; }
  [[nodiscard]] int stride() const { return camera_.width + 1; }

 private:
  PinholeCamera camera_;
  std::vector<Eigen::Vector2f> bearings_;
};

/// The camera with its image shrunk by `factor` (at least 1): the same field of view, fewer pixels.
/// For metering, previews and tests. Sizes round up.
[[nodiscard]] PinholeCamera shrunk(const PinholeCamera& camera, int factor);

}  // namespace km
