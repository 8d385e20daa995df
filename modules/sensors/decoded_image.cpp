#include "modules/sensors/decoded_image.hpp"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <opencv2/imgcodecs.hpp>
#include <string_view>
#include <vector>

namespace km {
namespace {

std::vector<char> read_bytes(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::error_code ignored;  // a size that cannot be had reads as an empty file, which is refused
  const auto size = std::filesystem::file_size(file, ignored);
  std::vector<char> bytes(ignored ? 0 : size);
  stream.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  bytes.resize(static_cast<std::size_t>(stream.gcount()));
  return bytes;
}

// The marker must lie near the end: embedded thumbnails have one of their own.
bool is_truncated(std::string_view bytes) {
  const std::string_view tail =
      bytes.substr(bytes.size() - std::min<std::size_t>(64, bytes.size()));
  if (bytes.starts_with("\xFF\xD8")) return tail.find("\xFF\xD9") == tail.npos;
  if (bytes.starts_with("\x89PNG")) return tail.find("IEND") == tail.npos;
  return false;
}

LoadedImage<cv::Mat> failure(ImageStatus status, const std::filesystem::path& file,
                             const std::string& why) {
  return {status, file.string() + ": " + why, {}};
}

std::string text(const cv::Size& size) {
  return std::to_string(size.width) + 'x' + std::to_string(size.height);
}

}  // namespace

LoadedImage<cv::Mat> decode_image(const std::filesystem::path& file, int flags,
                                  const cv::Size& size) {
  if (!std::filesystem::is_regular_file(file))
    return failure(ImageStatus::kMissing, file, "no such image");
  std::vector<char> bytes = read_bytes(file);
  if (bytes.empty()) return failure(ImageStatus::kUnreadable, file, "empty or unreadable file");
  if (is_truncated({bytes.data(), bytes.size()}))
    return failure(ImageStatus::kUnreadable, file, "truncated image");

  const cv::Mat encoded(1, static_cast<int>(bytes.size()), CV_8UC1, bytes.data());
  // IMREAD_UNCHANGED is -1, orientation included: a flag more would make it another mode.
  const int mode = flags == cv::IMREAD_UNCHANGED
                       ? flags
                       : flags | static_cast<int>(cv::IMREAD_IGNORE_ORIENTATION);
  cv::Mat decoded = cv::imdecode(encoded, mode);
  if (decoded.empty())
    return failure(ImageStatus::kUnreadable, file, "not an image that can be decoded");
  if (decoded.size() != size)
    return failure(ImageStatus::kWrongSize, file,
                   text(decoded.size()) + " px, the calibration says " + text(size));
  return {ImageStatus::kOk, {}, std::move(decoded)};
}

}  // namespace km
