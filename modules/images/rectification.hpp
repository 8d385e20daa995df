#pragma once

#include <array>
#include <opencv2/core.hpp>
#include <optional>

#include "modules/core/camera.hpp"
#include "modules/core/frame.hpp"

namespace km {

/// Where the image of `camera` shows what lies along `ray`, of any length, in its frame [px];
/// nullopt if it does not.
[[nodiscard]] std::optional<Eigen::Vector2d> seen_pixel(const Camera& camera,
                                                        const Eigen::Vector3d& ray);

/// Two virtual cameras without distortion, in the places of a rig's, whose rows are the same planes
/// of space: a point at depth z lies focal length * baseline / z further left in the right image.
///
/// The virtual optical axes are midway between the real ones, as far as the baseline's direction
/// leaves them free; the focal length is that of the left camera on its axis, so that nothing is
/// magnified where its lens distorts least. The images are as large as the left camera's: of a
/// fisheye lens of 190 degrees they hold the middle 120 degrees or so, of others nearly all.
class Rectification {
 public:
  /// The principal point of the virtual cameras.
  enum class Centre {
    kImage,     ///< The middle of the image.
    kLeftAxis,  ///< What the left camera has at its principal point stays where it is.
  };

  /// Throws std::invalid_argument for an RGB-D rig, a camera without pixels or focal length, and a
  /// right camera that does not look the way of the left one (30 degrees) or does not stand to its
  /// right.
  Rectification(const StereoRig& rig, Centre centre);

  /// The virtual left camera.
  [[nodiscard]] const Camera& camera() const { return camera_; }
  /// Turns vectors of it into the left camera's.
  [[nodiscard]] const Eigen::Matrix3d& R_left_rect() const { return R_left_rect_; }

  /// What the virtual camera on `side` (0: left) saw of `image`; 0 where the real one saw nothing.
  /// Throws std::invalid_argument if `image` is not of that camera's size.
  [[nodiscard]] cv::Mat rectified(const GrayImage& image, std::size_t side) const;

 private:
  std::array<Camera, 2> real_;
  Eigen::Matrix3d R_left_rect_;
  Camera camera_;
  // Where each virtual pixel lies in the real image, in cv::remap()'s compact form.
  std::array<cv::Mat, 2> maps_, map_fractions_;
};

}  // namespace km
