#pragma once

#include <cstdint>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <vector>

#include "modules/core/camera/camera.hpp"
#include "modules/core/camera/frame.hpp"
#include "modules/dense_sensing/stereo_depth_config.hpp"
#include "modules/images/rectification.hpp"

namespace km {

/// Images and labels as the virtual cameras of a Rectification see them, at the left camera's size
/// divided by `downscale`.
class StereoRectification {
 public:
  /// Throws std::invalid_argument for a rig that Rectification refuses.
  StereoRectification(const StereoRig& rig, int downscale);

  /// The virtual left camera.
  [[nodiscard]] const Camera& camera() const { return camera_; }
  [[nodiscard]] double baseline_m() const { return baseline_m_; }

  /// The image of the virtual camera on `side` (0: left), made from `image`; 0 outside the real
  /// camera's view. Throws std::invalid_argument if `image` has another size than that camera.
  [[nodiscard]] cv::Mat rectified(const GrayImage& image, std::size_t side) const;

  /// 255 for pixels in the real left camera's view, else 0.
  [[nodiscard]] const cv::Mat& seen() const { return seen_; }

  /// The values of the nearest pixels of the real left camera; zero outside its view. `value_at`
  /// returns that of an index into an image of the camera's size.
  template <typename ValueAt>
  [[nodiscard]] auto rectified(const ValueAt& value_at) const {
    std::vector<decltype(value_at(std::size_t{0}))> values;
    values.reserve(left_pixel_.size());
    for (const std::int32_t index : left_pixel_)
      values.push_back(index == kOutside ? typename decltype(values)::value_type{}
                                         : value_at(static_cast<std::size_t>(index)));
    return values;
  }

 private:
  static constexpr std::int32_t kOutside = -1;

  Rectification full_;
  Camera camera_;
  double baseline_m_;
  cv::Mat seen_;
  std::vector<std::int32_t> left_pixel_;  // for each virtual pixel, index of the nearest real one
};

/// Depth of every pixel from a stereo pair, by semi-global matching (Hirschmueller, "Stereo
/// Processing by Semiglobal Matching and Mutual Information", PAMI 2008) in OpenCV's variant, on
/// rectified images. A pixel has a depth if its match is unique, agrees with the match from right
/// to left, is no speckle, is in both images, and is within range.
///
/// The matcher's fractions of a pixel are biased towards whole numbers by up to a quarter. One step
/// of image alignment (Lucas and Kanade, "An Iterative Image Registration Technique with an
/// Application to Stereo Vision", 1981) corrects this. Deterministic. Not thread-safe.
class StereoDepth {
 public:
  /// Throws ConfigError if `config` is out of bounds or its depths leave no disparity to search.
  /// Throws std::invalid_argument for a rig that StereoRectification refuses.
  StereoDepth(const StereoRig& rig, const StereoDepthConfig& config);

  /// The camera of the depth images. It has no distortion, the position of the left camera, and the
  /// orientation of the rectified images.
  [[nodiscard]] const Camera& camera() const { return rectification_.camera(); }
  [[nodiscard]] const StereoRectification& rectification() const { return rectification_; }

  /// Largest number of searched disparities, from 0 on [px]: min_depth_m has the largest one, at
  /// most half of the image's width.
  [[nodiscard]] int disparities() const { return disparities_; }

  /// Precondition: both images have their camera's size.
  [[nodiscard]] DepthImage compute(const GrayImage& left, const GrayImage& right);

 private:
  // The largest disparity that images of a quarter of the size show [px]. No more are searched.
  [[nodiscard]] int largest_disparity(const cv::Mat& left, const cv::Mat& right) const;
  void fill(const cv::Mat& disparities_px, DepthImage& depth) const;

  StereoDepthConfig config_;
  StereoRectification rectification_;
  int disparities_;
  cv::Ptr<cv::StereoSGBM> matcher_, preview_;
};

}  // namespace km
