#include "apps/lab/simulation/dataset/image_encoding.hpp"

#include <opencv2/imgproc.hpp>
#include <stdexcept>

#include "modules/images/image_codec.hpp"
#include "modules/images/image_view.hpp"

namespace km {
namespace {

constexpr int kJpegQuality = 92;

void require_size(int width, int height, std::size_t pixels) {
  if (width <= 0 || height <= 0 ||
      pixels != static_cast<std::size_t>(width) * static_cast<std::size_t>(height))
    throw std::invalid_argument("an image of " + std::to_string(width) + 'x' +
                                std::to_string(height) + " has not " + std::to_string(pixels) +
                                " pixels");
}

std::vector<std::uint8_t> encode(const cv::Mat& image, ImageFormat format) {
  return format == ImageFormat::kJpeg ? encode_jpeg(image, kJpegQuality) : encode_png(image);
}

}  // namespace

std::string extension(ImageFormat format) {
  return format == ImageFormat::kJpeg ? ".jpg" : ".png";
}

std::vector<std::uint8_t> encode_gray(const GrayImage& image, ImageFormat format) {
  require_size(image.width, image.height, image.pixels.size());
  return encode(view(image), format);
}

std::vector<std::uint8_t> encode_color(int width, int height, const std::vector<std::uint8_t>& rgb,
                                       ImageFormat format) {
  if (rgb.size() % 3 != 0) throw std::invalid_argument("a colour image has three bytes a pixel");
  require_size(width, height, rgb.size() / 3);
  cv::Mat bgr;
  cv::cvtColor(view(width, height, CV_8UC3, rgb), bgr, cv::COLOR_RGB2BGR);
  return encode(bgr, format);
}

std::vector<std::uint8_t> encode_depth(int width, int height,
                                       const std::vector<std::uint16_t>& depth_mm) {
  require_size(width, height, depth_mm.size());
  return encode(view(width, height, CV_16UC1, depth_mm), ImageFormat::kPng);
}

std::vector<std::uint8_t> encode_labels(int width, int height, const std::vector<LabelId>& labels) {
  require_size(width, height, labels.size());
  return encode(view(width, height, CV_8UC1, labels), ImageFormat::kPng);
}

}  // namespace km
