#pragma once

#include <array>
#include <charconv>
#include <string>

namespace km {

/// The shortest text that reads back as the same double.
[[nodiscard]] inline std::string number_text(double value) {
  std::array<char, 32> digits{};
  return {digits.data(), std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr};
}

}  // namespace km
