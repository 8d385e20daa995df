#pragma once

#include <opencv2/calib3d.hpp>

#include "modules/core/frame.hpp"
#include "modules/dense_sensing/stereo_depth_config.hpp"
#include "modules/dense_sensing/stereo_rectification.hpp"

namespace km {

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
  [[nodiscard]] const PinholeCamera& camera() const { return rectification_.camera(); }
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
