#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "modules/core/camera/frame.hpp"

namespace km {

/// Pixels as an OpenCV matrix without a copy: row-major, of OpenCV's `type`. OpenCV has no
/// read-only view, so the caller must not write to it.
template <typename Pixel>
[[nodiscard]] cv::Mat view(int width, int height, int type, const std::vector<Pixel>& pixels) {
  return {height, width, type, const_cast<Pixel*>(pixels.data())};
}

[[nodiscard]] inline cv::Mat view(const GrayImage& image) {
  return view(image.width, image.height, CV_8UC1, image.pixels);
}

}  // namespace km
