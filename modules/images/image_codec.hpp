#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <opencv2/core.hpp>
#include <stdexcept>
#include <string_view>
#include <vector>

namespace km {

// PNG and JPEG files in memory. No other format is decoded: each decoder is code that images from
// the network can attack. cv::imdecode() offers many more, and the libraries of these take a tenth
// of a second of processor time at the start of every program that links them.

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

/// Largest size of the pixels of an image that is decoded [B].
constexpr std::size_t kMaxDecodedBytes = std::size_t{48} << 20U;

/// Decodes a PNG or JPEG file. Neither the orientation in an EXIF tag nor the gamma of a PNG file
/// changes pixels. Throws ImageCodecError.
[[nodiscard]] cv::Mat decode_pixels(std::string_view file, DecodedPixels pixels);

/// Decodes a file on disk. what() of its ImageCodecError begins with the file's name. Throws
/// InputFileError for a file that cannot be read.
[[nodiscard]] cv::Mat read_pixels(const std::filesystem::path& file, DecodedPixels pixels);

/// The upper 8 bits of a CV_16UC1 image: of the lower 12 if no value exceeds them, as many cameras
/// fill these, otherwise of all 16. With finer steps, a change of light would change the scale.
[[nodiscard]] cv::Mat upper_bits(const cv::Mat& image);

/// Encodes a CV_8UC1, CV_16UC1, CV_8UC3 (BGR) or CV_8UC4 (BGRA) image without loss. Throws
/// ImageCodecError.
[[nodiscard]] std::vector<std::uint8_t> encode_png(const cv::Mat& image);

/// Encodes a CV_8UC1 or CV_8UC3 (BGR) image; `quality` is 1 to 100. Colours have half the
/// resolution of brightness (4:2:0). Throws ImageCodecError.
[[nodiscard]] std::vector<std::uint8_t> encode_jpeg(const cv::Mat& image, int quality);

}  // namespace km
