#pragma once

#include <cstddef>
#include <filesystem>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "modules/core/camera/camera.hpp"
#include "modules/core/camera/color_image.hpp"
#include "modules/core/camera/frame.hpp"
#include "modules/core/map/label_palette.hpp"
#include "modules/images/image_codec.hpp"
#include "modules/sensors/dataset_reader.hpp"

namespace km {

/// An image from disk, or the reason why it cannot be used.
template <typename Image>
struct LoadedImage {
  std::optional<ReaderFault> fault;  ///< Present if the image cannot be used.
  std::string problem;               ///< Names the file; empty without a fault.
  Image image;                       ///< Empty with a fault.
};
using ImageResult = LoadedImage<GrayImage>;

/// Reads an image as 8-bit grey (PNG or JPEG). A file without its end marker counts as
/// unreadable, because decoders fill the missing part of a truncated JPEG with grey and report
/// success.
[[nodiscard]] ImageResult load_gray_image(const std::filesystem::path& file, int width, int height);

/// The colours of a BGR image; 0 x 0 for an image that failed or has no colours.
[[nodiscard]] ColorImage color_image_of(const LoadedImage<cv::Mat>& decoded);

/// A PNG or JPEG file. Never kWrongImageFormat.
[[nodiscard]] LoadedImage<cv::Mat> decode_image(const std::filesystem::path& file,
                                                DecodedPixels pixels, const cv::Size& size);

/// Decodes the bytes of an image file, which come from `place`.
[[nodiscard]] LoadedImage<cv::Mat> decode_image(std::string_view bytes, const std::string& place,
                                                DecodedPixels pixels, const cv::Size& size);

/// Result for an image that cannot be used; its problem is "PLACE: WHY".
[[nodiscard]] LoadedImage<cv::Mat> image_failure(ReaderFault fault, const std::string& place,
                                                 const std::string& why);

/// Failure of an image that has another size.
[[nodiscard]] LoadedImage<cv::Mat> wrong_size(const std::string& place, const cv::Size& found,
                                              const cv::Size& size);

/// The failure of decode_image(), as a result for another type of image.
template <typename Image>
[[nodiscard]] LoadedImage<Image> failure_of(const LoadedImage<cv::Mat>& decoded) {
  return {decoded.fault, decoded.problem, {}};
}

using DepthResult = LoadedImage<DepthImage>;

/// Reads a 16-bit image of one channel whose values are depths in units of `scale_m` [m]. The
/// values 0 and 65535 (which many sensors write) and depths outside `range` or beyond 65.535 m
/// count as no depth.
[[nodiscard]] DepthResult load_depth_image(const std::filesystem::path& file, int width, int height,
                                           double scale_m, const DepthRange& range);

/// Converts a decoded image from `place`. Images of 32-bit floating point numbers are in metres and
/// do not use `scale_m`.
[[nodiscard]] DepthResult depth_image_of(const LoadedImage<cv::Mat>& decoded,
                                         const std::string& place, double scale_m,
                                         const DepthRange& range);

struct LabelResult : LoadedImage<LabelImage> {
  std::size_t unknown_pixels = 0;  ///< Number of pixels with colours outside the palette; id 0.
};

/// Reads a label image. 8 bits of one channel are ids. Three or four channels are colours, which
/// `palette` maps to ids (Kimera-Semantics' format); transparency is ignored.
[[nodiscard]] LabelResult load_label_image(const std::filesystem::path& file, int width, int height,
                                           const LabelPalette& palette);

}  // namespace km
