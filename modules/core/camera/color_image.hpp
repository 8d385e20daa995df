#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace km {

/// 8-bit colours, row-major: pixels.size() == width * height.
struct ColorImage {
  using Pixel = std::array<std::uint8_t, 3>;  ///< red, green, blue

  int width = 0;   ///< [px]
  int height = 0;  ///< [px]
  std::vector<Pixel> pixels;
};

}  // namespace km
