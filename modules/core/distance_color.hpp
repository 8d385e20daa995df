#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

namespace km {

/// Colour (red, green, blue) of a distance to the next surface: from red at 0 over yellow to green
/// at the largest distance, blue on a surface and behind it. `share`: distance / largest distance.
[[nodiscard]] inline std::array<std::uint8_t, 3> distance_color(double share) {
  if (share <= 0.0) return {0, 0, 255};
  const auto byte = [](double value) {
    return static_cast<std::uint8_t>(std::lround(255.0 * std::clamp(value, 0.0, 1.0)));
  };
  return {byte(2.0 - 2.0 * share), byte(2.0 * share), 0};
}

/// Inverse of distance_color(), within 1/510; 0 for blue.
[[nodiscard]] inline double distance_share(const std::array<std::uint8_t, 3>& color) {
  const auto [red, green, blue] = color;
  return blue > 0 ? 0.0 : (green + 255 - red) / 510.0;
}

}  // namespace km
