#include "modules/ros_dds/jpeg_image.hpp"

#include <opencv2/imgcodecs.hpp>
#include <utility>

#include "modules/images/image_view.hpp"

namespace km {

RosCompressedImage jpeg_of(const GrayImage& image, RosHeader header) {
  constexpr int kQuality = 80;
  RosCompressedImage message{std::move(header), "jpeg", {}};
  cv::imencode(".jpg", view(image), message.data, {cv::IMWRITE_JPEG_QUALITY, kQuality});
  return message;
}

}  // namespace km
