#include "modules/view/view_image.hpp"

#include <algorithm>
#include <array>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

#include "modules/images/image_codec.hpp"
#include "modules/images/image_view.hpp"

namespace km {
namespace {

// The rest of an update is room for the features and the head.
constexpr std::size_t kMaxJpegBytes = kMaxViewBytes - 20000;
constexpr std::size_t kMaxFeatures = 2000;

std::vector<std::uint8_t> jpeg_of(const cv::Mat& image) {
  for (const int quality : {60, 30, 10})
    if (auto jpeg = encode_jpeg(image, quality); jpeg.size() <= kMaxJpegBytes) return jpeg;
  return {};  // Even the smallest quality is too large, as for noise in a tall and narrow image.
}

}  // namespace

ViewImage view_image(const TrackedImage& image, const Camera& camera) {
  const GrayImage& left = image.frame->left;
  if (left.width <= 0 || left.height <= 0)
    throw std::invalid_argument("view: an image without pixels");
  const double scale = std::min(1.0, static_cast<double>(kMaxViewWidth) / left.width);
  cv::Mat small = view(left);
  if (scale < 1.0) cv::resize(small, small, {}, scale, scale, cv::INTER_AREA);
  ViewImage result{image.frame->stamp, jpeg_of(small), {}};
  for (const Eigen::Vector2d& bearing : image.bearings) {
    const auto pixel = camera.project(bearing);
    if (!pixel || !pixel->allFinite() || result.features.size() == kMaxFeatures) continue;
    // Integer pixel coordinates are pixel centres.
    const Eigen::Vector2f there = (scale * (pixel->array() + 0.5) - 0.5).matrix().cast<float>();
    result.features.push_back({there.x(), there.y()});
  }
  return result;
}

}  // namespace km
