#pragma once

#include "modules/core/frame.hpp"
#include "modules/recordings/ros_messages.hpp"

namespace km {

/// An image as cameras' drivers compress it: JPEG.
[[nodiscard]] RosCompressedImage jpeg_of(const GrayImage& image, RosHeader header);

}  // namespace km
