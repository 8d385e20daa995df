#pragma once

#include <opencv2/core.hpp>

namespace km {

/// Disparities [px], 32-bit floats, moved to where the left image and the right one, shifted by
/// them, agree best around each pixel: one Gauss-Newton step on the squared difference in a window,
/// brightness apart. `steps` is what OpenCV's matchers give, sixteenths of a pixel, not positive
/// where there is none; there the result is 0, and where the images, although both have texture, do
/// not agree in the window. Moves of more than half a pixel are not made, nor any where the window
/// has no texture. Both images are 8-bit grey of the same size as `steps`.
[[nodiscard]] cv::Mat refined_disparities(const cv::Mat& left, const cv::Mat& right,
                                          const cv::Mat& steps);

}  // namespace km
