#include "modules/core/camera/image_size.hpp"

namespace km {
namespace {

std::uint32_t big_endian(std::string_view bytes) {
  std::uint32_t value = 0;
  for (const char byte : bytes) value = value << 8U | static_cast<unsigned char>(byte);
  return value;
}

// The size in the frame header of a JPEG file: that of the first marker SOF0 to SOF15. Three of
// these markers have another meaning (ITU T.81, table B.1).
std::optional<ImageSize> jpeg_size(std::string_view bytes) {
  for (std::size_t at = 2; at + 9 <= bytes.size() && bytes[at] == '\xFF';) {
    const int marker = static_cast<unsigned char>(bytes[at + 1]);
    if (marker == 0xFF) {  // fill byte
      ++at;
      continue;
    }
    if (marker >= 0xC0 && marker <= 0xCF && marker != 0xC4 && marker != 0xC8 && marker != 0xCC)
      return ImageSize{.width = big_endian(bytes.substr(at + 7, 2)),
                       .height = big_endian(bytes.substr(at + 5, 2))};
    at += 2 + big_endian(bytes.substr(at + 2, 2));
  }
  return std::nullopt;
}

}  // namespace

std::optional<ImageSize> stated_image_size(std::string_view bytes) {
  if (bytes.starts_with("\xFF\xD8")) return jpeg_size(bytes);
  // Offsets of the chunk IHDR, the first
  constexpr std::size_t kWidth = 16, kHeight = 20, kEnd = 24;
  if (!bytes.starts_with("\x89PNG") || bytes.size() < kEnd) return std::nullopt;
  return ImageSize{.width = big_endian(bytes.substr(kWidth, 4)),
                   .height = big_endian(bytes.substr(kHeight, 4))};
}

}  // namespace km
