#pragma once

#include <cstdint>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <vector>

#include "modules/core/camera.hpp"
#include "modules/core/frame.hpp"
#include "modules/core/label_palette.hpp"
#include "modules/dense_sensing/stereo_depth_config.hpp"
#include "modules/images/rectification.hpp"

namespace km {

/// What the virtual cameras of a Rectification see, of images and of labels, at a size that is the
/// left camera's over `downscale`.
class StereoRectification {
 public:
  /// Throws std::invalid_argument for a rig that Rectification refuses.
  StereoRectification(const StereoRig& rig, int downscale);

  /// The virtual left camera.
  [[nodiscard]] const Camera& camera() const { return camera_; }
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
  Camera camera_;
  double baseline_m_;
  cv::Size label_size_;
  cv::Mat seen_;
  std::vector<std::int32_t> left_pixel_;  // of each virtual one: index of the nearest real one
};

/// Depth of every pixel from a stereo pair, by semi-global matching (Hirschmueller, "Stereo
/// Processing by Semiglobal Matching and Mutual Information", PAMI 2008) in OpenCV's variant, on
/// images rectified as the calibration says. Left with a depth are pixels whose match is unique,
/// the same from right to left, no speckle, and within range. The matcher's fractions of a pixel
/// lean towards whole ones by up to a quarter; one step of image alignment (Lucas and Kanade, "An
/// Iterative Image Registration Technique with an Application to Stereo Vision", 1981) puts that
/// right. Deterministic. Not thread-safe.
class StereoDepth {
 public:
  /// Throws ConfigError if `config` is out of bounds or its depths leave nothing to search, and
  /// std::invalid_argument for a rig that StereoRectification refuses.
  StereoDepth(const StereoRig& rig, const StereoDepthConfig& config);

  /// The camera of the depth images: without distortion, in the place of the left one.
  [[nodiscard]] const Camera& camera() const { return rectification_.camera(); }
  [[nodiscard]] const StereoRectification& rectification() const { return rectification_; }

  /// Disparities that are searched, from 0 on [px].
  [[nodiscard]] int disparities() const { return disparities_; }

  /// Precondition: both images have their camera's size.
  [[nodiscard]] DepthImage compute(const GrayImage& left, const GrayImage& right);

 private:
  void fill(const cv::Mat& disparities_px, DepthImage& depth) const;

  StereoDepthConfig config_;
  StereoRectification rectification_;
  int disparities_;
  cv::Ptr<cv::StereoSGBM> matcher_;
};

}  // namespace km
