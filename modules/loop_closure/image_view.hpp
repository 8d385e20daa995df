#pragma once

#include <cstdint>
#include <opencv2/core.hpp>

#include "modules/core/frame.hpp"

namespace km {

/// `image` as OpenCV sees it, without a copy. OpenCV has no read-only view: not to be written to.
[[nodiscard]] inline cv::Mat view(const GrayImage& image) {
  return {image.height, image.width, CV_8UC1, const_cast<std::uint8_t*>(image.pixels.data())};
}

}  // namespace km
