#pragma once

#include "modules/core/frame.hpp"
#include "modules/recordings/ros_messages.hpp"

namespace km {

/// Compresses an image to JPEG, as camera drivers do.
[[nodiscard]] RosCompressedImage jpeg_of(const GrayImage& image, RosHeader header);

}  // namespace km
