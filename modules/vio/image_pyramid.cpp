#include "modules/vio/image_pyramid.hpp"

#include <opencv2/video/tracking.hpp>

#include "modules/images/image_view.hpp"

namespace km {

ImagePyramid::ImagePyramid(const GrayImage& image, int levels, bool with_derivatives)
    : with_derivatives_(with_derivatives) {
  const cv::Size window(kWindow_px, kWindow_px);
  constexpr bool kReuseInput = false;  // copied: the pyramid owns its pixels
  cv::buildOpticalFlowPyramid(view(image), maps_, window, levels, with_derivatives,
                              cv::BORDER_REFLECT_101, cv::BORDER_CONSTANT, kReuseInput);
}

const cv::Mat& ImagePyramid::level(int level) const {
  return maps_[static_cast<std::size_t>(with_derivatives_ ? 2 * level : level)];
}

}  // namespace km
