#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace km {

struct ImageSize {
  std::uint32_t width = 0;   ///< [px]
  std::uint32_t height = 0;  ///< [px]

  bool operator==(const ImageSize&) const = default;
};

/// The size in the header of a PNG or JPEG file, read without decoding pixels. nullopt if there is
/// none.
[[nodiscard]] std::optional<ImageSize> stated_image_size(std::string_view bytes);

}  // namespace km
