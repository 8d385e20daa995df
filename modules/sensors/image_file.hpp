#pragma once

#include <cstddef>
#include <filesystem>
#include <opencv2/core.hpp>
#include <string>
#include <string_view>

#include "modules/core/camera.hpp"
#include "modules/core/frame.hpp"
#include "modules/core/label_palette.hpp"
#include "modules/sensors/dataset_reader.hpp"

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

/// Any image file as OpenCV decodes it with the cv::ImreadModes `flags`; its orientation tag is
/// ignored. Never kWrongFormat.
[[nodiscard]] LoadedImage<cv::Mat> decode_image(const std::filesystem::path& file, int flags,
                                                const cv::Size& size);

/// Likewise, of the bytes of such a file, which come from `place`.
[[nodiscard]] LoadedImage<cv::Mat> decode_image(std::string_view bytes, const std::string& place,
                                                int flags, const cv::Size& size);

/// Why an image cannot be used: "PLACE: WHY".
[[nodiscard]] LoadedImage<cv::Mat> image_failure(ImageStatus status, const std::string& place,
                                                 const std::string& why);

/// Why an image is none of this size.
[[nodiscard]] LoadedImage<cv::Mat> wrong_size(const std::string& place, const cv::Size& found,
                                              const cv::Size& size);

/// What decode_image() said, for an image of another type.
template <typename Image>
[[nodiscard]] LoadedImage<Image> failure_of(const LoadedImage<cv::Mat>& decoded) {
  return {decoded.status, decoded.problem, {}};
}

using DepthResult = LoadedImage<DepthImage>;

/// Reads a 16-bit image of one channel whose values are depths in units of `scale_m` [m]. No depth:
/// 0, 65535 (what many sensors write), and what lies outside `range` or beyond 65.535 m.
[[nodiscard]] DepthResult load_depth_image(const std::filesystem::path& file, int width, int height,
                                           double scale_m, const DepthRange& range);

/// Likewise, of an image from `place` that is decoded already; one of 32-bit floating point numbers
/// is in metres, whatever the scale.
[[nodiscard]] DepthResult depth_image_of(const LoadedImage<cv::Mat>& decoded,
                                         const std::string& place, double scale_m,
                                         const DepthRange& range);

struct LabelResult : LoadedImage<LabelImage> {
  std::size_t unknown_pixels = 0;  ///< Of a colour that the palette does not have: id 0.
};

/// Reads a label image: 8 bits of one channel are ids; of three or four channels colours, mapped to
/// ids by `palette` (Kimera-Semantics' format), transparency ignored.
[[nodiscard]] LabelResult load_label_image(const std::filesystem::path& file, int width, int height,
                                           const LabelPalette& palette);

}  // namespace km
