#pragma once

#include <opencv2/core.hpp>
#include <vector>

namespace km {

/// An image with what OpenCV's KLT tracker works on: window 21 px, 4 levels.
struct KltImage {
  cv::Mat image;                 ///< 8-bit grey.
  std::vector<cv::Mat> pyramid;  ///< With borders and derivatives.
};

/// Copies `image`, which may end before the result.
[[nodiscard]] KltImage make_klt_image(const cv::Mat& image);

/// Where a point went, and how far off it came back.
struct RoundTrip {
  cv::Point2f to;
  double error_px = 0.0;  ///< Between start and end after there and back; infinity: lost.
};

/// Tracks points from `a` to `b`, started at the old place, and from where they arrived back to
/// `a`, started there. With `starts_b`, one for each, there at these and back at the points:
/// between views that lie far apart, so that the way back is found if it is there.
[[nodiscard]] std::vector<RoundTrip> round_trip(const KltImage& a, const KltImage& b,
                                                const std::vector<cv::Point2f>& points,
                                                std::vector<cv::Point2f> starts_b = {});

/// Corners as all figures count them: Shi-Tomasi, quality 0.01, 15 px apart, as many as there are.
[[nodiscard]] std::vector<cv::Point2f> corners_of(const cv::Mat& image);

}  // namespace km
