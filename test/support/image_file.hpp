#pragma once

#include <filesystem>
#include <opencv2/core.hpp>
#include <vector>

#include "modules/core/io/write_file.hpp"
#include "modules/images/image_codec.hpp"

namespace km {

inline void write_png(const std::filesystem::path& file, const cv::Mat& pixels) {
  const std::vector<std::uint8_t> bytes = encode_png(pixels);
  write_file(file, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

inline cv::Mat decoded(const std::vector<std::uint8_t>& file, DecodedPixels pixels) {
  return decode_pixels({reinterpret_cast<const char*>(file.data()), file.size()}, pixels);
}

}  // namespace km
