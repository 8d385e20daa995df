#include "modules/ros_dds/jpeg_image.hpp"

#include <utility>

#include "modules/images/image_codec.hpp"
#include "modules/images/image_view.hpp"

namespace km {

RosCompressedImage jpeg_of(const GrayImage& image, RosHeader header) {
  constexpr int kQuality = 80;
  return {std::move(header), "jpeg", encode_jpeg(view(image), kQuality)};
}

}  // namespace km
