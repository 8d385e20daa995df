#pragma once

#include <array>
#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "modules/core/camera.hpp"
#include "modules/core/frame.hpp"
#include "modules/core/label_palette.hpp"

namespace km {

/// Two virtual cameras without distortion, in the places of a rig's, whose rows are the same planes
/// of space: a point at depth z lies focal length * baseline / z further left in the right image.
///
/// The virtual optical axes are midway between the real ones, as far as the baseline's direction
/// leaves them free; the focal length is that of the left camera, so that nothing is magnified
/// where its lens distorts least. The images are as large as the left camera's, over `downscale`.
class StereoRectification {
 public:
  /// Throws std::invalid_argument for an RGB-D rig, a camera without pixels or focal length, and a
  /// right camera that does not look the way of the left one or does not stand to its right.
  StereoRectification(const StereoRig& rig, int downscale);

  /// The virtual left camera.
  [[nodiscard]] const PinholeCamera& camera() const { return camera_; }
  [[nodiscard]] double baseline_m() const { return baseline_m_; }

  /// What the virtual camera on `side` (0: left) saw of `image`; 0 where the real one saw nothing.
  /// Precondition: `image` has that camera's size.
  [[nodiscard]] cv::Mat rectified(const GrayImage& image, int side) const;

  /// Pixels that the real left camera saw: 255, else 0.
  [[nodiscard]] const cv::Mat& seen() const { return seen_; }

  /// The labels of the nearest pixels; 0 where there are none. Precondition: `labels` has the left
  /// camera's size.
  [[nodiscard]] LabelImage rectified(const LabelImage& labels) const;

 private:
  static constexpr std::int32_t kOutside = -1;

  PinholeCamera camera_;
  double baseline_m_ = 0.0;
  std::array<cv::Size, 2> real_sizes_;
  // At full size: where each virtual pixel lies in the real image, in cv::remap()'s compact form.
  std::array<cv::Mat, 2> maps_, map_fractions_;
  cv::Mat seen_;
  std::vector<std::int32_t> left_pixel_;  // of each virtual one: index of the nearest real one
};

}  // namespace km
