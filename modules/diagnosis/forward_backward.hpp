#pragma once

#include <opencv2/core.hpp>
#include <vector>

namespace km {

/// An image with the pyramid for OpenCV's KLT tracker: window 21 px, 4 levels.
struct KltImage {
  cv::Mat image;                 ///< 8-bit grey.
  std::vector<cv::Mat> pyramid;  ///< With borders and derivatives.
};

/// Copies `image`.
[[nodiscard]] KltImage make_klt_image(const cv::Mat& image);

/// Result of tracking a point forward and back.
struct ForwardBackward {
  cv::Point2f to;
  double error_px =
      0.0;  ///< Distance between the start and the point tracked back; infinity: lost.
};

/// Tracks points from `a` to `b` and back to `a`. Each search starts at the pixel of the tracked
/// point. With `starts_b`, one for each point, the search in `b` starts at these, and the search
/// back starts at the original point. This suits views that are far apart, because the search back
/// then succeeds if the point is visible.
[[nodiscard]] std::vector<ForwardBackward> forward_backward(const KltImage& a, const KltImage& b,
                                                            const std::vector<cv::Point2f>& points,
                                                            std::vector<cv::Point2f> starts_b = {});

/// Shi-Tomasi corners, strongest first, quality 0.01, 15 px apart, without a limit on their number.
[[nodiscard]] std::vector<cv::Point2f> corners_of(const cv::Mat& image);

}  // namespace km
