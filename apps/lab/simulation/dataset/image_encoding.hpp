#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "modules/core/frame.hpp"
#include "modules/core/label_palette.hpp"

namespace km {

/// Format of stored camera images. The recorded images used here are JPEG at quality 92. It
/// correlates the noise of neighbouring pixels, which affects features and optical flow.
enum class ImageFormat { kJpeg, kPng };

/// ".jpg" or ".png".
[[nodiscard]] std::string extension(ImageFormat format);

/// Encoded images. The same input gives the same bytes. All throw std::invalid_argument if the
/// number of pixels is not width * height. Colours are red, green, blue, interleaved.
[[nodiscard]] std::vector<std::uint8_t> encode_gray(const GrayImage& image, ImageFormat format);
[[nodiscard]] std::vector<std::uint8_t> encode_color(int width, int height,
                                                     const std::vector<std::uint8_t>& rgb,
                                                     ImageFormat format);

/// 16-bit PNG of millimetres, 0: no depth.
[[nodiscard]] std::vector<std::uint8_t> encode_depth(int width, int height,
                                                     const std::vector<std::uint16_t>& depth_mm);

/// 8-bit PNG of class ids.
[[nodiscard]] std::vector<std::uint8_t> encode_labels(int width, int height,
                                                      const std::vector<LabelId>& labels);

}  // namespace km
