#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <stdexcept>
#include <string_view>
#include <vector>

namespace km {

// PNG and JPEG files in memory. No other format is decoded: each decoder is code that images from
// the network can attack. cv::imdecode() offers some twenty, and the libraries of these take 0.2 s
// of processor time at the start of every program that links them.

/// Says why an image cannot be decoded or encoded.
class ImageCodecError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

enum class DecodedPixels {
  kGray,       ///< CV_8UC1. The upper 8 bits of 16 stay.
  kEightBits,  ///< CV_8UC1 or CV_8UC3 (BGR). Transparency is ignored.
  kStored,     ///< CV_8UC1, CV_16UC1, CV_8UC3 (BGR) or CV_8UC4 (BGRA, with transparency).
};

/// Longest side of an image that is decoded [px].
constexpr int kMaxImageSide_px = 16384;

/// Decodes a PNG or JPEG file. Neither the orientation in an EXIF tag nor the gamma of a PNG file
/// changes pixels. Throws ImageCodecError.
[[nodiscard]] cv::Mat decode_pixels(std::string_view file, DecodedPixels pixels);

/// Encodes a CV_8UC1, CV_16UC1, CV_8UC3 (BGR) or CV_8UC4 (BGRA) image without loss. `level` is that
/// of zlib, 1 (fast) to 9 (small). Throws ImageCodecError.
[[nodiscard]] std::vector<std::uint8_t> encode_png(const cv::Mat& image, int level);

/// Encodes a CV_8UC1 or CV_8UC3 (BGR) image; `quality` is 1 to 100. Colours have half the
/// resolution of brightness (4:2:0). Throws ImageCodecError.
[[nodiscard]] std::vector<std::uint8_t> encode_jpeg(const cv::Mat& image, int quality);

}  // namespace km
