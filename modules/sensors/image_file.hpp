#pragma once

#include <filesystem>
#include <string>

#include "modules/core/frame.hpp"
#include "modules/sensors/reader_report.hpp"

namespace km {

enum class ImageStatus { kOk, kMissing, kUnreadable, kWrongSize, kWrongFormat };

/// How a failure is counted. Precondition: not kOk.
[[nodiscard]] ReaderFault fault_of(ImageStatus status);

/// An image from disk, or why there is none.
template <typename Image>
struct LoadedImage {
  ImageStatus status = ImageStatus::kOk;
  std::string problem;  ///< Names the file; empty if kOk.
  Image image;          ///< Empty unless kOk.
};
using ImageResult = LoadedImage<GrayImage>;

/// Reads an image as 8-bit grey, whatever its format (PNG, JPEG and what OpenCV knows besides).
/// PNG and JPEG files without their end marker count as unreadable: decoders fill what is missing
/// of a truncated JPEG with grey and report success.
[[nodiscard]] ImageResult load_gray_image(const std::filesystem::path& file, int width, int height);

}  // namespace km
