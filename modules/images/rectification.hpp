#pragma once

#include <array>
#include <opencv2/core.hpp>
#include <optional>

#include "modules/core/camera/camera.hpp"
#include "modules/core/camera/frame.hpp"

namespace km {

/// Pixel at which `camera` shows `ray`, a vector of any length in the camera's frame [px]; nullopt
/// if the ray is not in view.
[[nodiscard]] std::optional<Eigen::Vector2d> seen_pixel(const Camera& camera,
                                                        const Eigen::Vector3d& ray);

/// Two virtual cameras without distortion, at the positions of a rig's cameras. Equal rows of both
/// images show the same plane of space. A point at depth z is focal length * baseline / z further
/// left in the right image.
///
/// The virtual optical axes are midway between the real ones as far as the direction of the
/// baseline permits. The focal length is that of the left camera on its axis, so that the centre,
/// where its lens distorts least, is not magnified. The images have the size of the left camera's.
/// They cover about the middle 120 degrees of a fisheye lens of 190 degrees, and nearly all of the
/// view of other lenses.
class Rectification {
 public:
  /// The principal point of the virtual cameras.
  enum class Centre {
    kImage,     ///< The middle of the image.
    kLeftAxis,  ///< The pixel of the left camera's principal point stays in place.
  };

  /// Throws std::invalid_argument for an RGB-D rig and for a camera without pixels or focal length.
  /// Also throws it for a right camera whose direction differs from the left one's by more than 30
  /// degrees, or that is not to its right.
  Rectification(const StereoRig& rig, Centre centre);

  /// The virtual left camera.
  [[nodiscard]] const Camera& camera() const { return camera_; }
  /// Rotates vectors from the virtual left camera to the real one.
  [[nodiscard]] const Eigen::Matrix3d& R_left_rect() const { return R_left_rect_; }

  /// The image of the virtual camera on `side` (0: left), made from `image`; 0 outside the real
  /// camera's view. Throws std::invalid_argument if `image` has another size than that camera.
  [[nodiscard]] cv::Mat rectified(const GrayImage& image, std::size_t side) const;

 private:
  std::array<Camera, 2> real_;
  Eigen::Matrix3d R_left_rect_;
  Camera camera_;
  // Position of each virtual pixel in the real image, in cv::remap()'s compact form.
  std::array<cv::Mat, 2> maps_, map_fractions_;
};

}  // namespace km
