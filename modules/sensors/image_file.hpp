#pragma once

#include <filesystem>
#include <string>

#include "modules/core/frame.hpp"

namespace km {

enum class ImageStatus { kOk, kMissing, kUnreadable, kWrongSize };

/// An image from disk, or why there is none.
struct ImageResult {
  ImageStatus status = ImageStatus::kOk;
  std::string problem;  ///< Names the file; empty if kOk.
  GrayImage image;      ///< Empty unless kOk.
};

/// Reads an image as 8-bit grey, whatever its format (PNG, JPEG and what OpenCV knows besides).
/// PNG and JPEG files without their end marker count as unreadable: decoders fill what is missing
/// of a truncated JPEG with grey and report success.
[[nodiscard]] ImageResult load_gray_image(const std::filesystem::path& file, int width, int height);

}  // namespace km
