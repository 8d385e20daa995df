#include "modules/vio/image_pyramid.hpp"

#include <opencv2/video/tracking.hpp>

namespace km {

ImagePyramid::ImagePyramid(const GrayImage& image, const TrackerConfig& config,
                           bool with_derivatives)
    : with_derivatives_(with_derivatives) {
  // cv::Mat has no const form; the pixels are only read, and copied because they are not reused.
  const cv::Mat view(image.height, image.width, CV_8UC1,
                     const_cast<std::uint8_t*>(image.pixels.data()));
  const cv::Size window(config.window_px, config.window_px);
  constexpr bool kReuseInput = false;
  cv::buildOpticalFlowPyramid(view, maps_, window, config.pyramid_levels, with_derivatives,
                              cv::BORDER_REFLECT_101, cv::BORDER_CONSTANT, kReuseInput);
}

const cv::Mat& ImagePyramid::level(int level) const {
  return maps_[static_cast<std::size_t>(with_derivatives_ ? 2 * level : level)];
}

}  // namespace km
