#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

#include "modules/core/camera/frame.hpp"

namespace km {

/// The image pyramid of one camera image, built once and shared by all code that tracks, matches
/// and scores in that image. Owns its pixels.
class ImagePyramid {
 public:
  ImagePyramid() = default;

  static constexpr int kWindow_px = 15;  ///< Side of the square window around a feature.

  /// Copies `image` into a bordered pyramid of `levels` above the full image; each doubles the
  /// reach of a search. Only an image from which windows are taken needs derivatives.
  ImagePyramid(const GrayImage& image, int levels, bool with_derivatives);

  [[nodiscard]] bool empty() const { return maps_.empty(); }

  /// Input of cv::calcOpticalFlowPyrLK: levels, interleaved with derivatives if there are any.
  [[nodiscard]] const std::vector<cv::Mat>& maps() const { return maps_; }

  /// Grey image of `level`; 0 is the full image. Pixel (x, y) lies at (2^level x, 2^level y) of the
  /// full image.
  [[nodiscard]] const cv::Mat& level(int level) const;

  /// Scharr derivatives (d/dx, d/dy) of the full image, 32 times the grey levels per pixel, as
  /// 16-bit integers. Precondition: built with derivatives.
  [[nodiscard]] const cv::Mat& derivatives() const { return maps_[1]; }

 private:
  std::vector<cv::Mat> maps_;
  bool with_derivatives_ = false;
};

}  // namespace km
