#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "modules/core/camera.hpp"
#include "modules/core/frame.hpp"
#include "modules/core/label_palette.hpp"
#include "modules/images/rectification.hpp"

namespace km {

/// What the virtual cameras of a Rectification see, of images and of labels, at a size that is the
/// left camera's over `downscale`.
class StereoRectification {
 public:
  /// Throws std::invalid_argument for a rig that Rectification refuses.
  StereoRectification(const StereoRig& rig, int downscale);

  /// The virtual left camera.
  [[nodiscard]] const PinholeCamera& camera() const { return camera_; }
  [[nodiscard]] double baseline_m() const { return baseline_m_; }

  /// What the virtual camera on `side` (0: left) saw of `image`; 0 where the real one saw nothing.
  /// Throws std::invalid_argument if `image` is not of that camera's size.
  [[nodiscard]] cv::Mat rectified(const GrayImage& image, std::size_t side) const;

  /// Pixels that the real left camera saw: 255, else 0.
  [[nodiscard]] const cv::Mat& seen() const { return seen_; }

  /// The labels of the nearest pixels; 0 where there are none. Precondition: `labels` has the left
  /// camera's size.
  [[nodiscard]] LabelImage rectified(const LabelImage& labels) const;

 private:
  static constexpr std::int32_t kOutside = -1;

  Rectification full_;
  PinholeCamera camera_;
  double baseline_m_;
  cv::Size label_size_;
  cv::Mat seen_;
  std::vector<std::int32_t> left_pixel_;  // of each virtual one: index of the nearest real one
};

}  // namespace km
