#pragma once

#include <filesystem>
#include <opencv2/core.hpp>

#include "modules/sensors/image_file.hpp"

namespace km {

/// Any image file as OpenCV decodes it with the cv::ImreadModes `flags`; its orientation tag is
/// ignored. Never kWrongFormat.
[[nodiscard]] LoadedImage<cv::Mat> decode_image(const std::filesystem::path& file, int flags,
                                                const cv::Size& size);

/// What decode_image() said, for an image of another type.
template <typename Image>
[[nodiscard]] LoadedImage<Image> failure_of(LoadedImage<cv::Mat> decoded) {
  return {decoded.status, std::move(decoded.problem), {}};
}

}  // namespace km
